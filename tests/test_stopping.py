"""A signal ends a command with exit code 130 at whatever moment it comes, and nothing is left behind."""

import os
import signal
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest

pytestmark = pytest.mark.skipif(os.name != "posix", reason="signals are others' there")
HUNG = 60  # [s] after which a process is taken to hang

LONG_CALL = "hashlib.pbkdf2_hmac('sha256', b'', b'', 2**31 - 1)"  # minutes in C, without Python's lock
SWALLOWED = "try:\n        time.sleep(100)\n    except KeyboardInterrupt:\n        pass\n    time.sleep(100)"
BECOMES_ANOTHER = (
    "try:\n        time.sleep(100)\n    except KeyboardInterrupt:\n        raise ImportError('numpy') from None"
)
COMPILED_TEXT = "exec('import time; time.sleep(100)')"
IN_A_THREAD = f"with ThreadPoolExecutor() as pool:\n        pool.submit(lambda: {LONG_CALL}).result()"
IN_PROCESSES = "with ProcessPoolExecutor(2) as pool:\n        list(pool.map(time.sleep, [100, 100]))"
# a child that multiprocessing does not know of, as in the moment of its fork; time.sleep outlasts HUNG
FORKED = pytest.param(
    SWALLOWED.replace("pass", "os.fork()"),
    marks=pytest.mark.skipif(sys.platform != "linux", reason="the system tells no children"),
)
PROGRAM = """import hashlib, os, sys, time
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from pathlib import Path
from ers_mj.processes import passing
from ers_mj.processes.stopping import guarded
def work():
    passing.pass_with_process(Path({part!r}))
    print("ready", flush=True)
    {job}
    return 0
sys.exit(guarded(work))
"""


def stopped(program: list[str], number: int = signal.SIGINT) -> tuple[int, str]:
    """(exit code, complaint) of a process that is sent a signal when it has said that it is ready."""
    paths = os.pathsep.join(filter(None, [str(Path(__file__).parents[1]), os.environ.get("PYTHONPATH")]))
    with subprocess.Popen(
        [sys.executable, *program],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env={**os.environ, "PYTHONPATH": paths},
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),  # a shell's background has it ignored
    ) as process:
        try:
            assert process.stdout.readline().strip() == "ready"
            process.send_signal(number)
            _, complaint = process.communicate(timeout=HUNG)
        finally:
            process.kill()
    return process.returncode, complaint


@pytest.mark.parametrize(
    "job",
    [LONG_CALL, SWALLOWED, BECOMES_ANOTHER, COMPILED_TEXT, IN_A_THREAD, IN_PROCESSES, FORKED],
    ids=lambda job: job[:30],
)
def test_any_moment_ends_with_130(job, tmp_path):
    part = tmp_path / "part"
    (part / "deep").mkdir(parents=True)
    code, complaint = stopped(["-c", PROGRAM.format(part=str(part), job=job)])
    assert code == 130 and complaint.startswith("ers: stopped") and "Traceback" not in complaint
    assert not part.exists()


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGHUP])
def test_other_signals_stop_as_well(number, tmp_path):
    program = PROGRAM.format(part=str(tmp_path / "part"), job="time.sleep(100)")
    heeding = (
        f"import signal; signal.signal({int(number)}, signal.SIG_DFL)\n{program}"  # whatever the tests were begun by
    )
    assert stopped(["-c", heeding], number)[0] == 130


def test_what_is_ignored_from_outside_stays_ignored(tmp_path):
    program = PROGRAM.format(part=str(tmp_path / "part"), job="time.sleep(0.3)")
    ignoring = f"import signal; signal.signal(signal.SIGHUP, signal.SIG_IGN)\n{program}"
    assert stopped(["-c", ignoring], signal.SIGHUP)[0] == 0


def test_a_child_ends_with_its_parent(tmp_path):
    if sys.platform != "linux":
        pytest.skip("on Linux alone")
    child = "from ers_mj.processes.passing import end_with_parent; import time; end_with_parent(); "
    child += "print('up', flush=True); "
    parent = (
        "import os, signal, subprocess, sys\n"
        f"child = subprocess.Popen([sys.executable, '-c', {child + 'time.sleep(100)'!r}], stdout=subprocess.PIPE)\n"
        "child.stdout.readline(); print(child.pid, flush=True); os.kill(os.getpid(), signal.SIGKILL)"
    )
    done = subprocess.run([sys.executable, "-c", parent], capture_output=True, text=True, timeout=HUNG)
    ended = int(done.stdout)
    for _ in range(HUNG * 10):  # it is ended before or after its parent is seen to be
        try:
            if Path(f"/proc/{ended}/stat").read_text().rpartition(")")[2].split()[0] == "Z":
                return
        except FileNotFoundError:
            return
        signal.sigtimedwait([], 0.1)
    pytest.fail("the child goes on")


@pytest.mark.parametrize("redirect", [">&-", "2>&-", "> /dev/full"])
def test_a_stream_that_takes_nothing_is_no_traceback(redirect, tmp_path):
    if "full" in redirect and not Path("/dev/full").exists():
        pytest.skip("there is no full device")
    with tempfile.TemporaryFile("w+") as errors:
        code = subprocess.run(
            ["sh", "-c", f"exec {sys.executable} -m ers_mj cache --json {redirect}"],
            stderr=None if redirect == "2>&-" else errors,
            stdout=subprocess.DEVNULL,
            cwd=Path(__file__).parents[1],
            env={**os.environ, "XDG_CACHE_HOME": str(tmp_path)},
        ).returncode
        errors.seek(0)
        complaint = errors.read()
    assert code == (2 if "full" in redirect else 0) and "Traceback" not in complaint
    assert ("No space left" in complaint) == ("full" in redirect)
