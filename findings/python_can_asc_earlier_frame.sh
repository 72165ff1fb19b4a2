#!/bin/sh
# python-can's ASC puts a frame that is a little earlier than the first one hundreds of thousands of hours later.
#
# Guess: an ASC log counts from its first frame, so that a frame that a second interface hands over 10 ms late, with its
# own earlier stamp, is written at -0.01 s, or in order; or, if it cannot be, is refused.
#
# Seen (python-can 4.6.1): it is written at its absolute time, as if that were relative: of frames stamped 1.7e9,
# 1.7e9 + 0.02 and 1.7e9 - 0.01 s, ASC gives back 0, 0.02 and about 1.7e9 s, without a warning; BLF gives 0, 0.02 and 0 s
# (the third one at the first one's time); candump's log keeps all three. Sorted by time, ASC's frame is the last of all.
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install -q python-can==4.6.1
"$folder/venv/bin/python" - "$folder" <<'PYTHON'
import sys

import can

START = 1.7e9
stamps = [START, START + 0.02, START - 0.01]
for ending, expected in ((".asc", START - 0.01), (".blf", 0.0), (".log", -0.01)):
    with can.Logger(f"{sys.argv[1]}/rec{ending}") as log:
        for t in stamps:
            log(can.Message(t, 0x100, data=b"\1", is_extended_id=False, channel=0))
    with can.LogReader(f"{sys.argv[1]}/rec{ending}") as log:
        times = [message.timestamp for message in log]
    print(ending, [round(t - times[0], 6) for t in times])
    assert abs(times[2] - times[0] - expected) < 1e-3
PYTHON
