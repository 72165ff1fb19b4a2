#!/bin/sh
# pymavlink scales a field of an ArduPilot log by its type's letter, and not by the multiplier that the log declares.
#
# Guess: a DataFlash log says for each field its unit (UNIT) and its multiplier (MULT), through FMTU: a field with unit
# deg and multiplier 0.01 comes back in degrees, whatever type it is stored as.
#
# Seen (pymavlink 2.4.50): of the same 12.34 deg, stored as hundredths with the multiplier 0.01, the field of type c
# (int16 * 100) comes back as 12.34 and the field of type i (int32) as 1234; get_unit() says "deg" of the one and
# "cdeg" of the other: the factor stands in the unit's name and nowhere else.
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install -q --no-compile pymavlink==2.4.50
"$folder/venv/bin/python" - "$folder/rec.bin" <<'PYTHON'
import struct
import sys

from pymavlink import DFReader

FORMATS = {128: ("FMT", "BBnNZ", "Type,Length,Name,Format,Columns", 89), 129: ("UNIT", "QbZ", "TimeUS,Id,Label", 76),
           130: ("MULT", "Qbd", "TimeUS,Id,Mult", 20), 131: ("FMTU", "QBNN", "TimeUS,FmtType,UnitIds,MultIds", 44),
           132: ("ENC", "Qci", "TimeUS,Short,Long", 17)}
head = lambda kind: b"\xa3\x95" + bytes([kind])
out = [head(128) + struct.pack("<BB4s16s64s", kind, size, name.encode(), form.encode(), fields.encode())
       for kind, (name, form, fields, size) in FORMATS.items()]
out += [head(129) + struct.pack("<Qb64s", 0, ord(mark), label) for mark, label in (("s", b"s"), ("d", b"deg"))]
out += [head(130) + struct.pack("<Qbd", 0, ord(mark), factor) for mark, factor in (("F", 1e-6), ("B", 1e-2))]
out.append(head(131) + struct.pack("<QB16s16s", 0, 132, b"sdd", b"FBB"))
out += [head(132) + struct.pack("<Qhi", 1000 * k, 1234, 1234) for k in range(3)]
with open(sys.argv[1], "wb") as file:
    file.write(b"".join(out))
log = DFReader.DFReader_binary(sys.argv[1], zero_time_base=True)
while (message := log.recv_msg()) is not None and message.get_type() != "ENC":
    pass
units = [message.fmt.get_unit(field) for field in ("Short", "Long")]
print("short:", message.Short, units[0], "  long:", message.Long, units[1])
assert (message.Short, message.Long) == (12.34, 1234) and units == ["deg", "cdeg"]
PYTHON
