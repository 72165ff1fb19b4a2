"""`model.fmu`: FMI 2.0 for co-simulation, C source that any compiler takes, and the binary of this machine where it has
one.
"""

from __future__ import annotations

import hashlib
import io
import math
import platform
import shutil
import subprocess
import sys
import tempfile
import zipfile
from collections.abc import Iterable, Mapping
from importlib.resources import files
from pathlib import Path
from string import Template
from xml.sax.saxutils import quoteattr

import numpy as np

from ers_mj.export.base import Target, Written
from ers_mj.export.portable import STATE, WITHIN
from ers_mj.export.servo import Servo
from ers_mj.export.translation import translated

TUNABLE = (
    "a_1", "a_mech_plus", "a_mech_minus", "a_emf", "b", "c_1", "c_2_plus", "c_2_minus", "theta_0", "bias", "K", "D",
    "I", "L", "R",
)  # fmt: skip
FIRST = 4  # reference of the first of these: input, output, speed and start come before
STEP = 1e-3  # [s] of communication that is suggested
HELD = "the input is held within a communication step and taken in at its end: choose the step as your samples are"
SOURCE_ONLY = (
    "no C compiler was here: model.fmu holds source alone, which `fmpy compile` or the importing tool compiles"
)
ROUNDED = "the delay is kept in steps: it is stretched for as long as it lasts where the communication step changes"


class Fmu(Target):
    """A servo that any FMI tool steps."""

    name, file, tool = "fmu", "model.fmu", "FMI 2.0 (co-simulation)"

    def write(self, servo: Servo) -> Written:
        source = source_of(servo)
        guid = hashlib.sha256(source.encode()).hexdigest()[:32]
        source = source.replace("$guid", guid)
        entries = {"modelDescription.xml": _description(servo, guid).encode(), "sources/model.c": source.encode()}
        binaries = _binaries(source)
        late = servo.portable.numbers["delay"] + servo.portable.numbers["dead_time"] > 0
        lost = (*servo.portable.left_out, HELD, *([ROUNDED] if late else []), *([] if binaries else [SOURCE_ONLY]))
        return Written(_zipped({**entries, **binaries}), lost)


def tunable(servo: Servo) -> list[str]:
    """The numbers that an FMI tool may change."""
    return [
        name for name in TUNABLE if 0.0 != servo.portable.numbers[name] and math.isfinite(servo.portable.numbers[name])
    ]


def source_of(servo: Servo) -> str:
    """model.c, its guid still open."""
    from ers_mj import __version__

    p = servo.portable
    kept = {name: n + 1 for name, n in p.kept(0.5 * p.step).items()}
    scalars = {**p.numbers, **{f"{name}_kept": float(n) for name, n in kept.items()}}
    arrays = {**p.tables, **{name: x for name, x in p.constants.items() if name not in p.remembering}}
    fixed = {name: p.constants[name] for name in p.remembering}
    values = {
        "title": f"{servo.name}: a servo's model, {servo.signals[0]} in, {servo.signals[1]} out.",
        "version": __version__,
        "step": repr(p.step),
        "rest": repr(servo.rest),
        "held": repr(servo.held),
        "servo_fields": _fields(scalars, {name: x.size for name, x in arrays.items()}),
        "state_fields": _fields((*STATE, *WITHIN), {**kept, **{name: x.size for name, x in fixed.items()}}),
        "servo_values": _values(scalars, arrays),
        "remembering": "\n".join(
            f"    i->x.{name}[{k}] = {_number(v)};" for name, x in fixed.items() for k, v in enumerate(x) if v != 0.0
        ),
        "variables": "\n".join(f"    case {FIRST + k}: return &i->c.{n};" for k, n in enumerate(tunable(servo))),
        "most_kept": repr(float(max(kept.values()))),
        "scheme": translated(p.text),
        "guid": "$guid",
    }
    return Template((files("ers_mj.export") / "fmi2.txt").read_text(encoding="utf-8")).substitute(values)


def _fields(scalars: Iterable[str], arrays: Mapping[str, int]) -> str:
    return "\n".join(f"    double {text};" for text in (*scalars, *(f"{name}[{n}]" for name, n in arrays.items())))


def _values(scalars: Mapping[str, float], arrays: Mapping[str, np.ndarray]) -> str:
    lines = [f"    .{name} = {_number(x)}," for name, x in scalars.items()]
    return "\n".join([*lines, *(f"    .{name} = {{{', '.join(map(_number, x))}}}," for name, x in arrays.items())])


def _number(x: float) -> str:
    x = float(x)
    return repr(x) if math.isfinite(x) else ("INFINITY" if x > 0 else "-INFINITY")


def _description(servo: Servo, guid: str) -> str:
    """modelDescription.xml."""
    from ers_mj import __version__

    (into, out), y = servo.signals, servo.output_unit
    numbers = servo.portable.numbers
    variables = [
        _variable(into, 0, "input", "discrete", f'start="{servo.held!r}"', servo.input_unit, "held within a step"),
        _variable(out, 1, "output", "continuous", "", y, "what the sensor shows"),
        _variable("speed", 2, "local", "continuous", "", f"{y}/s", "of the output"),
        _variable("start", 3, "parameter", "fixed", f'start="{servo.rest!r}"', y, "where it rests at the beginning"),
        *(
            _variable(n, FIRST + k, "parameter", "tunable", f'start="{numbers[n]!r}"', "", "per total inertia")
            for k, n in enumerate(tunable(servo))
        ),
    ]
    units = "".join(f"<Unit name={quoteattr(u)}/>" for u in dict.fromkeys([servo.input_unit, y, f"{y}/s"]))
    return f"""<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName={quoteattr(servo.name)} guid="{guid}" version="{__version__}"
  generationTool="ers-mj {__version__}" variableNamingConvention="flat" numberOfEventIndicators="0">
  <CoSimulation modelIdentifier="model" canHandleVariableCommunicationStepSize="true" canGetAndSetFMUstate="true"
    canBeInstantiatedOnlyOncePerProcess="false"><SourceFiles><File name="model.c"/></SourceFiles></CoSimulation>
  <UnitDefinitions>{units}</UnitDefinitions>
  <DefaultExperiment startTime="0.0" stopTime="10.0" stepSize="{STEP!r}"/>
  <ModelVariables>
    {chr(10).join("    " + v for v in variables).strip()}
  </ModelVariables>
  <ModelStructure>
    <Outputs><Unknown index="2"/></Outputs>
    <InitialUnknowns><Unknown index="2"/></InitialUnknowns>
  </ModelStructure>
</fmiModelDescription>
"""


def _variable(name: str, reference: int, causality: str, variability: str, start: str, unit: str, said: str) -> str:
    told = f" unit={quoteattr(unit)}" if unit else ""
    return (
        f'<ScalarVariable name={quoteattr(name)} valueReference="{reference}" causality="{causality}"'
        f' variability="{variability}" description={quoteattr(said)}><Real{told} {start}/></ScalarVariable>'
    )


def _binaries(source: str) -> dict[str, bytes]:
    """The compiled source under the path that FMI gives it, empty where no compiler is here."""
    places = {("linux", "x86_64"): ("linux64", ".so"), ("darwin", "x86_64"): ("darwin64", ".dylib")}
    place, compiler = places.get((sys.platform, platform.machine())), shutil.which("cc")
    if place is None or compiler is None:
        return {}
    with tempfile.TemporaryDirectory() as folder:
        file, made = Path(folder) / "model.c", Path(folder) / f"model{place[1]}"
        file.write_text(source, encoding="utf-8")
        done = subprocess.run(
            [compiler, "-std=c99", "-O2", "-fPIC", "-shared", file.name, "-o", made.name, "-lm"],
            cwd=folder, capture_output=True, check=False,
        )  # fmt: skip
        return {f"binaries/{place[0]}/{made.name}": made.read_bytes()} if done.returncode == 0 else {}


def _zipped(entries: Mapping[str, bytes]) -> bytes:
    """An archive that is the same whenever it is written."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in entries.items():
            archive.writestr(zipfile.ZipInfo(name), content, zipfile.ZIP_DEFLATED)
    return buffer.getvalue()
