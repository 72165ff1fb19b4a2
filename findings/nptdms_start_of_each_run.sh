#!/bin/sh
# npTDMS puts every run of a TDMS file at the start of the last one, and joins them without the pause.
#
# Guess: a logger that is started twice appends to its file, each segment with its own wf_start_offset; time_track() of
# the channel then gives each sample's time, the first run at its offset, the second one after the pause.
#
# Seen (npTDMS 1.13.0): properties are merged over the segments, the last value wins, and time_track() counts all samples
# on from there: ten samples that were taken at 2.00 to 2.04 s and 7.00 to 7.04 s come back at 7.00 to 7.09 s. So the
# first run is 5 s late, the pause is gone, and a model is fitted over a seam that nobody sees.
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install -q npTDMS==1.13.0 numpy
"$folder/venv/bin/python" - "$folder/two.tdms" <<'PYTHON'
import sys

import nptdms
import numpy as np

taken = np.concatenate([2.0 + 0.01 * np.arange(5), 7.0 + 0.01 * np.arange(5)])
with nptdms.TdmsWriter(sys.argv[1]) as writer:
    for offset in (2.0, 7.0):
        properties = {"wf_start_time": np.datetime64("2024-05-01T12:00:00", "us"), "wf_start_offset": offset,
                      "wf_increment": 0.01}
        writer.write_segment([nptdms.ChannelObject("bench", "angle", np.arange(5.0), properties=properties)])
channel = nptdms.TdmsFile.read(sys.argv[1])["bench"]["angle"]
print("taken at     ", taken)
print("time_track() ", channel.time_track())
assert len(channel) == 10 and channel.properties["wf_start_offset"] == 7.0
assert np.allclose(channel.time_track(), 7.0 + 0.01 * np.arange(10))
PYTHON
