"""Units: compiled apart and kept under their own digests, in a folder that belongs to the user alone."""

import os
import pickle
import subprocess
import sys
import textwrap
from functools import cache
from pathlib import Path

import pytest
from forked import Warm

from ers_mj.plants.compiling.code_folder import refusal
from ers_mj.plants.compiling.digest import digest_of

ROOT = Path(__file__).resolve().parents[1]
SMALL = """
import sys
from numba import njit, types
from ers_mj.plants.compiling.compiled import address_of, by_address, inline, kernel, unit

F = types.float64
{constant}

@inline
def twice(x):
    return 2.0 * x

@unit(F(F))
def lowest(x):
    return {body}

@unit(F(F))
def middle(x):
    return lowest(x) + twice(x)

@kernel(F(F))
def highest(x):
    return middle(x) + lowest(x)
"""


@pytest.fixture
def home(tmp_path):
    """A folder for a small module and for the code that is kept."""
    (tmp_path / "cache").mkdir(mode=0o700)
    return tmp_path


# Python takes what it compiled for its source's where second and size are the same, as those of a quick edit may be
NOT_KEPT = "import sys\nsys.dont_write_bytecode = True\n"
WITHOUT_JIT = {"NUMBA_DISABLE_JIT": "1"}


def process(folder, program, **more):
    """(exit status, what it says, what it complains of) of a process of its own: a fresh one where numba is told to be
    otherwise.
    """
    environment = {**os.environ, "PYTHONPATH": f"{ROOT}{os.pathsep}{folder}", **more}
    program = NOT_KEPT + textwrap.dedent(program)
    if any(name.startswith("NUMBA") for name in more):
        done = subprocess.run(
            [sys.executable, "-c", program], env=environment, cwd=folder, capture_output=True, text=True
        )
        return done.returncode, done.stdout, done.stderr
    return warm().run(program, folder, environment)


def run(home, program, **more):
    """What a process with a cache of its own says, and what it complains of."""
    status, told, said = process(home, program, XDG_CACHE_HOME=str(home / "cache"), **more)
    assert status == 0, said
    return told.strip(), said


@pytest.fixture(scope="module", autouse=True)
def ended():
    """The warm process ends with the last test."""
    yield
    warm().__exit__()
    warm.cache_clear()


@cache
def warm() -> Warm:
    return Warm()


def write(home, body, constant="K = 3.0"):
    (home / "small.py").write_text(SMALL.format(body=body, constant=constant))


def kept(home):
    """Names of what is kept, by the time at which it was written."""
    return {path.name: path.stat().st_mtime_ns for path in (home / "cache").rglob("*.nbc")}


ASK = "import small; print(small.highest(5.0))"


def test_units_call_each_other_and_the_plain_functions_agree(home):
    write(home, "K * x + 1.0")
    assert run(home, ASK)[0] == run(home, ASK, **WITHOUT_JIT)[0] == "42.0"
    assert len(kept(home)) == 3
    before = kept(home)
    assert run(home, ASK)[0] == "42.0" and kept(home) == before


def test_an_edited_unit_compiles_itself_alone_and_is_never_run_stale(home):
    write(home, "K * x + 1.0")
    run(home, ASK)
    before = kept(home)
    write(home, "K * x + 2.0")
    assert run(home, ASK)[0] == "44.0"
    assert len(kept(home)) == len(before) + 1 and kept(home).items() > before.items()
    write(home, "K * x + 2.0", constant="K = 4.0")
    assert run(home, ASK)[0] == "54.0"
    assert len(kept(home)) == len(before) + 2


def test_what_is_put_into_others_compiles_them(home):
    write(home, "x")
    assert run(home, ASK)[0] == "20.0"
    text = (home / "small.py").read_text()
    (home / "small.py").write_text(text.replace("2.0 * x", "3.0 * x"))
    assert run(home, ASK)[0] == "25.0" and len(kept(home)) == 4


def test_a_callee_may_be_declared_after_its_caller_is_kept(home):
    write(home, "x")
    run(home, ASK)
    for path in (home / "cache").rglob("*lowest*"):
        path.unlink()
    assert run(home, ASK)[0] == "20.0"


def test_the_importing_of_plants_compiles_nothing(home):
    _, said = run(
        home, "import ers_mj.plants.kernel.event_integrator, ers_mj.plants.reduced, ers_mj.plants.kernel.tangents"
    )
    assert not said and not kept(home)


def test_an_error_of_a_unit_comes_up(home):
    write(home, "1.0 / (x - 5.0)")
    for more in ({}, WITHOUT_JIT):
        ask = f"import small\ntry:\n    {ASK.split('; ')[1]}\nexcept ZeroDivisionError:\n    print('raised')"
        assert run(home, ask, **more)[0] == "raised"


LAW = """
import numpy as np
from ers_mj.effects import BY_NAME
from ers_mj.effects.base import law
from ers_mj.plants.reduced import ReducedModel, lumped

drag = type(BY_NAME["quadratic_drag"])

@law
def torque(p, theta, w, j, t):
    return {law}

drag.torque = torque
drag.is_lawful = lambda self, p: True
model = ReducedModel(lumped({{"b": 10.0, "a_2": 1.0}}), [("quadratic_drag", np.array([1.0, np.inf]))])
t = np.linspace(0.0, {end}, 20)
"""


@pytest.mark.parametrize("more", [{}, WITHOUT_JIT], ids=["compiled", "plain"])
def test_a_law_that_fails_says_so(tmp_path, more):
    program = LAW.format(law="1.0 / (p[0] - 1.0)", end=0.1) + "model.simulate(t, np.ones(20))"
    status, _, said = process(tmp_path, program, **more)
    assert status != 0 and "ZeroDivisionError" in said


def test_an_edited_law_is_run_and_leaves_the_kernels_as_they_are(tmp_path):
    answers, heard = {}, []
    for law in ("-p[0] * w", "-2.0 * p[0] * w", "-p[0] * w"):
        program = LAW.format(law=law, end=0.1) + "print(model.simulate(t, np.ones(20)).theta[-1].hex())"
        status, told, said = process(tmp_path, program)
        assert status == 0 and answers.setdefault(law, told) == told
        heard.append(said)
    assert not any("compiling" in text for text in heard[1:])  # the first one may find an empty cache
    assert len(set(answers.values())) == 2


def test_a_model_goes_to_another_process_without_an_address(tmp_path):
    import numpy as np

    from ers_mj.plants.reduced import ReducedModel, lumped

    model = ReducedModel(lumped({"b": 10.0, "a_2": 1.0, "c_2": 2.0}), [("stribeck", np.array([1.0, 0.1, 1.0, np.inf]))])
    t = np.linspace(0.0, 0.1, 50)
    here = model.simulate(t, np.ones(50)).theta
    (tmp_path / "model.pickle").write_bytes(pickle.dumps(model))
    program = (
        "import pickle, numpy as np\nmodel = pickle.load(open('model.pickle', 'rb'))\n"
        "print(model.simulate(np.linspace(0.0, 0.1, 50), np.ones(50)).theta.tobytes().hex())"
    )
    status, told, said = process(tmp_path, program)
    assert status == 0, said
    assert bytes.fromhex(told) == here.tobytes()


def test_what_is_compiled_without_jit_moves_alike(tmp_path):
    program = """
    import numpy as np
    from ers_mj.plants.reduced import ReducedModel, lumped
    c = lumped({"b": 10.0, "a_1": 5.0, "a_2": 3.0, "c_1": 0.5, "c_2": 1.0, "theta_0": 0.1})
    t = np.linspace(0.0, 0.2, 60)
    stribeck, backlash = [1.0, 0.1, 1.0, np.inf], [0.01, 0.5, 0.5, 80.0, 0.1]
    for effects in ([], [("stribeck", np.array(stribeck))], [("backlash", np.array(backlash))]):
        print(ReducedModel(c, effects).simulate(t, 3.0 * np.sin(40.0 * t)).theta.tobytes().hex())
    """
    (status, compiled, said), (_, plain, _) = (process(tmp_path, program, **more) for more in ({}, WITHOUT_JIT))
    assert status == 0, said
    assert compiled == plain


def test_a_fingerprint_tells_code_and_numbers_but_no_place():
    def of(text):
        scope = {}
        exec(text, scope)
        return digest_of(scope["f"], lambda _: None)

    one = of("K = 2.0\ndef f(x):\n    return K * x")
    assert one == of("K = 2.0\n\n\ndef f(x):\n    return K * x")
    assert one != of("K = 3.0\ndef f(x):\n    return K * x")
    assert one != of("K = 2.0\ndef f(x):\n    return K + x")
    inner = "def g(x):\n    return {} * x\ndef f(x):\n    return g(x)"
    assert of(inner.format(1.0)) != of(inner.format(2.0))


def test_the_folder_belongs_to_the_user_alone(tmp_path):
    folder = tmp_path / "ers_mj" / "code"
    assert refusal(folder) == ""
    assert folder.stat().st_mode & 0o777 == folder.parent.stat().st_mode & 0o777 == 0o700


@pytest.mark.parametrize("level", [0, 1])
@pytest.mark.parametrize("mode", [0o770, 0o707])
def test_a_folder_open_to_others_is_refused(tmp_path, level, mode):
    folder = tmp_path / "ers_mj" / "code"
    folder.mkdir(parents=True, mode=0o700)
    folder.parent.chmod(0o700)
    (folder, folder.parent)[level].chmod(mode)
    assert "open to others" in refusal(folder)


def given_away(path, monkeypatch):
    """Let a file or folder belong to another user, who is not the system."""
    if os.getuid() == 0:
        os.chown(path, 4711, -1)
    else:
        monkeypatch.setattr(os, "getuid", lambda: path.stat().st_uid + 1)


@pytest.mark.parametrize("what", ["ers_mj/code", "ers_mj", "ers_mj/code/law.nbi", "."])
def test_what_another_user_has_put_there_is_refused(what, tmp_path, monkeypatch):
    folder = tmp_path / "home/ers_mj/code"
    assert refusal(folder) == ""
    (folder / "law.nbi").write_bytes(b"")
    given_away(tmp_path / "home" / what, monkeypatch)
    assert "another user" in refusal(folder)


def test_a_folder_that_others_may_rename_is_refused(tmp_path):
    folder = tmp_path / "open" / "ers_mj" / "code"
    assert refusal(folder) == ""
    folder.parent.parent.chmod(0o777)
    assert "open to others" in refusal(folder)


WHERE = (
    "import small; from ers_mj.plants.compiling.code_folder import code_folder; print(small.highest(5.0), "
    "oct(code_folder().stat().st_mode & 0o777), code_folder())"
)


def test_where_it_is_refused_a_private_folder_that_lasts_is_taken(home):
    (home / "cache" / "ers_mj").mkdir()
    (home / "cache" / "ers_mj").chmod(0o777)
    (home / "tmp").mkdir(mode=0o700)
    write(home, "x")
    (first, said), (second, _) = (run(home, WHERE, TMPDIR=str(home / "tmp")) for _ in range(2))
    assert first == second and first.split()[:2] == ["20.0", "0o700"] and said == ""
    place = Path(first.split()[2])
    assert place.parent.parent == home / "tmp" and list(place.glob("*.nbc")) and not kept(home)


def test_where_that_is_refused_too_a_fresh_one_is_taken_and_said_once(home):
    for folder in (home / "cache" / "ers_mj", home / "tmp" / f"ers_mj-{os.getuid()}"):
        folder.mkdir(parents=True)
        folder.chmod(0o777)
    write(home, "x")
    (first, said), (second, _) = (run(home, WHERE, TMPDIR=str(home / "tmp")) for _ in range(2))
    assert said.count("open to others") == 1 and "compiled code is kept in" in said
    assert first.split()[:2] == ["20.0", "0o700"] and first.split()[2] != second.split()[2]
    assert not Path(first.split()[2]).exists() and not kept(home)


def without_writing(home) -> dict[str, str]:
    """The environment of a process that sees the cache as on a disk that cannot be written, also by root."""
    (home / "tmp").mkdir(mode=0o700, exist_ok=True)
    (home / "sitecustomize.py").write_text(
        "import errno, os, tempfile\nmade = tempfile.TemporaryFile\n"
        "def refused(*given, dir=None, **more):\n"
        f"    if str(dir).startswith({str(home / 'cache')!r}):\n"
        "        raise OSError(errno.EROFS, os.strerror(errno.EROFS))\n"
        "    return made(*given, dir=dir, **more)\n"
        "tempfile.TemporaryFile = refused\n"
    )
    return {"TMPDIR": str(home / "tmp")}


def test_a_cache_that_can_only_be_read_is_used_and_what_it_lacks_is_kept_elsewhere_once(home):
    write(home, "x")
    run(home, ASK)
    before, more = kept(home), without_writing(home)
    assert run(home, ASK, **more) == ("20.0", "") and not list((home / "tmp").rglob("*.nbc"))
    write(home, "x + 1.0")
    for _ in range(2):
        assert run(home, ASK, **more) == ("22.0", "") and kept(home) == before
    added = {path.name: path.stat().st_mtime_ns for path in (home / "tmp").rglob("*.nbc")}
    assert added and run(home, ASK, **more)[0] == "22.0"
    assert added == {path.name: path.stat().st_mtime_ns for path in (home / "tmp").rglob("*.nbc")}


@pytest.mark.parametrize(
    ("suffix", "damage", "is_writable"),
    [("nbi", lambda x: b"", True), ("nbc", lambda x: x[: len(x) // 2], True), ("nbi", lambda x: bytes(len(x)), False)],
)
def test_a_cache_that_is_not_whole_is_said_and_mended_once(suffix, damage, is_writable, home):
    write(home, "x")
    run(home, ASK)
    for path in (home / "cache").rglob(f"*.{suffix}"):
        path.write_bytes(damage(path.read_bytes()))
    more = {} if is_writable else without_writing(home)
    told, said = run(home, ASK, **more)
    assert told == "20.0" and "is not whole" in said
    assert run(home, ASK, **more) == ("20.0", "")


def test_a_full_disk_costs_the_next_call_a_compilation_and_no_more(home):
    write(home, "x")
    program = "import errno, builtins\nopened = builtins.open\n" + textwrap.dedent(
        """
        def full(file, mode="r", *given, **more):
            if ".nb" in str(file) and "w" in mode:
                raise OSError(errno.ENOSPC, "No space left on device")
            return opened(file, mode, *given, **more)
        builtins.open = full
        """
    )
    told, said = run(home, program + ASK)
    assert told == "20.0" and said.count("No space left") == 1 and not kept(home)


def test_the_first_call_says_what_it_compiles(home):
    write(home, "x + K")
    assert run(home, ASK)[1] == ""  # three parts: no word
    with (home / "small.py").open("a") as module:
        for k in range(3):
            module.write(f"\n@unit(F(F))\ndef part_{k}(x):\n    return x + {k}.0\n")
        module.write("\n@kernel(F(F))\ndef several(x):\n    return middle(part_0(x) + part_1(x) + part_2(x))\n")
    _, said = run(home, "import small; small.several(5.0)")
    assert said.count("compiling") == 1 and "for this machine, once: about" in said
