"""Whoever works tasks off: each once, none lost when a worker is killed, what is wrong with a cluster said at once."""

import shutil
import socket
import time
from pathlib import Path

import pytest
from stub_tasks import ended_always, ended_once, made_case, refused, squared

from ers_mj.control.monte_carlo import Fleet, scatter
from ers_mj.control.trial import Conditions
from ers_mj.door.known import known
from ers_mj.errors import ErsError, InputError
from ers_mj.proving.conduct import conduct
from ers_mj.workers.base import Task
from ers_mj.workers.hiring import crew

PACKAGE = Path(__file__).resolve().parents[1] / "ers_mj"


def squares(count, *more):
    return [Task(f"s{k}", squared, (k, *more)) for k in range(count)]


def values(found):
    found = [(done.name, done.value) for done in found]
    assert len(dict(found)) == len(found)  # nothing twice
    return dict(found)


WANTED = {f"s{k}": k * k for k in range(20)}


@pytest.mark.parametrize("jobs", [1, 2])
def test_every_task_is_done_once_here(jobs):
    assert values(crew(jobs).run(squares(20))) == WANTED


@pytest.mark.parametrize("jobs", [1, 2])
def test_what_a_task_raises_is_raised(jobs):
    with pytest.raises(InputError, match="7: cannot be used"):
        list(crew(jobs).run([Task("r", refused, (7,))]))


def test_a_killed_process_takes_nothing_with_it(tmp_path):
    tasks = [*squares(6), Task("once", ended_once, (str(tmp_path),)), *squares(20)[6:]]
    assert values(crew(2).run(tasks)) == WANTED | {"once": "done"}


def test_what_always_ends_its_process_is_given_up():
    found = {done.name: done for done in crew(2).run([Task("bad", ended_always, ()), *squares(20)])}
    assert "ended twice" in found["bad"].lost and not any(done.lost for name, done in found.items() if name != "bad")
    assert {name: done.value for name, done in found.items() if name != "bad"} == WANTED


def test_given_up_early_nothing_is_left_running(tmp_path):
    """Two of six are done when the caller leaves; those under way are ended."""
    running = crew(2).run(squares(6, str(tmp_path), 0.4))
    next(running)
    running.close()
    before = len(list(tmp_path.iterdir()))
    time.sleep(0.6)
    assert len(list(tmp_path.iterdir())) == before < 6


# -- a cluster --------------------------------------------------------------------------------------------------------


distributed = pytest.importorskip("distributed")
from dask_cluster import Cluster  # noqa: E402


@pytest.fixture(scope="module")
def cluster():
    with Cluster() as started:
        yield started


def test_a_killed_worker_takes_nothing_with_it(tmp_path):
    """One of two is killed when the third answer is there: the same answers, each once."""
    with Cluster() as its_own:
        hired = crew(1, its_own.address)
        found = []
        for done in hired.run(squares(20, str(tmp_path), 0.05)):
            found.append(done)
            if len(found) == 3:
                its_own.workers[0].kill()
        hired.close()
    assert values(found) == WANTED
    ran = [path.name.partition("-")[0] for path in tmp_path.iterdir()]
    assert set(ran) == {str(k) for k in range(20)}


def test_equal_calls_are_done_each(cluster, tmp_path):
    """Dask takes equal arguments for one task."""
    hired = crew(1, cluster.address)
    tasks = [Task(f"t{k}", squared, (3, str(tmp_path))) for k in range(5)]
    assert values(hired.run(tasks)) == {f"t{k}": 9 for k in range(5)}
    assert values(hired.run(tasks)) == {f"t{k}": 9 for k in range(5)}
    hired.close()
    assert len(list(tmp_path.iterdir())) == 10


def test_what_a_task_raises_there_is_raised_here(cluster):
    hired = crew(1, cluster.address)
    with pytest.raises(InputError, match="7: cannot be used"):
        list(hired.run([Task("r", refused, (7,))]))
    assert values(hired.run(squares(3))) == {"s0": 0, "s1": 1, "s2": 4}
    hired.close()


def test_a_scheduler_that_leaves_is_said():
    with Cluster(1) as its_own:
        hired = crew(1, its_own.address)
        with pytest.raises(ErsError, match="the scheduler went away, what was done is kept"):
            for _ in hired.run(squares(40, None, 0.05)):
                its_own.scheduler.kill()
        hired.close()


@pytest.mark.parametrize("address", ["tcp://127.0.0.1:{free}", "127.0.0.1:{free}", "nonsense://x", "no such host"])
def test_a_cluster_that_is_not_there(address, monkeypatch):
    monkeypatch.setattr("ers_mj.workers.cluster.ANSWERS_WITHIN", 0.5)
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        with pytest.raises(InputError, match="no Dask scheduler answers there"):
            crew(1, address.format(free=free.getsockname()[1]))


def test_an_empty_address_starts_nothing():
    with pytest.raises(InputError, match="--cluster is empty"):
        crew(1, "")


def test_a_cluster_without_workers():
    with Cluster(0) as empty, pytest.raises(InputError, match="has no workers"):
        crew(1, empty.address)


@pytest.mark.parametrize(
    ("touch", "sentence"),
    [
        ('\n__version__ = "9.9.9"\n', "has ers_mj 9.9.9, here it is"),
        ("\n# touched\n", "other sources of ers_mj"),
        ("\nraise ImportError\n", "has no ers_mj"),
    ],
)
def test_a_worker_of_another_version_is_refused(tmp_path, touch, sentence):
    """Its package is a copy of this one that was touched."""
    shutil.copytree(PACKAGE, tmp_path / "ers_mj", ignore=shutil.ignore_patterns("__pycache__", "demo_data"))
    with (tmp_path / "ers_mj" / "__init__.py").open("a") as init:
        init.write(touch)
    with Cluster(1, (tmp_path,)) as other, pytest.raises(InputError, match=sentence):
        crew(1, other.address)


def test_a_monte_carlo_is_the_same_on_a_cluster(cluster, tmp_path):
    """With a reference from a file, which the workers do not have."""
    rows = ["t_s,theta_ref_deg", *(f"{k / 1000},{15 + (k > 20)}" for k in range(150))]
    (tmp_path / "mine.csv").write_text("\n".join(rows))
    asked = (["pid"], ["reduced"], ["step", str(tmp_path / "mine.csv")], Conditions(rate_hz=1000.0))
    fleet, hired = Fleet(known("table1"), 3, 1.2), crew(1, cluster.address)
    assert scatter(fleet, *asked, crew=hired) == scatter(fleet, *asked)
    hired.close()


def test_a_proof_is_the_same_on_a_cluster(cluster, tmp_path):
    """A case made and answered there, by a diagnosis that refuses what is no recording."""
    tasks = [Task(f"case-{k:03d}", made_case, (f"case-{k:03d}", k)) for k in (1,)]
    proofs = []
    for hired, name in ((crew(1, cluster.address), "there"), (crew(1), "here")):
        proofs.append(conduct(tmp_path / name, tasks, {"kind": "simulated"}, crew=hired))
        hired.close()
    there, here = proofs
    assert (there.truths, there.sha256) == (here.truths, here.sha256)
    told = [{name: (x["error"], x["document"]) for name, x in proof.answers.items()} for proof in proofs]
    assert told[0] == told[1] and "ers: rec1.csv" in told[0]["case-001"][0]
