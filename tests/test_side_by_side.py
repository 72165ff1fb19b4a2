"""Work shared with forks of a process: same results, same counts, and nothing lost with a helper. In processes of their
own, since a test's has threads.
"""

import subprocess
import sys
import textwrap

import pytest

from ers_mj.processes.side_by_side import each

BEGIN = """
import os, time
import numpy as np
from ers_mj.plants.effort import Effort
from ers_mj.processes import side_by_side
from ers_mj.processes.side_by_side import each

here, items = os.getpid(), [("item", k) for k in range(12)]
slow = lambda item: (time.sleep(0.05), os.getpid(), item)[1:]
"""
pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="forks are used on Linux alone")


def said(text: str) -> str:
    ended = subprocess.run([sys.executable, "-c", BEGIN + textwrap.dedent(text)], capture_output=True, text=True)
    assert ended.returncode == 0, ended.stderr
    return ended.stdout.strip()


def test_results_are_in_order_by_several_processes_and_items_come_back_as_themselves():
    text = """
    found = each(slow, items, 3)
    print([item[1] for _, item in found] == list(range(12)), len({process for process, _ in found}))
    print(all(item is given for (_, item), given in zip(found, items)))
    """
    assert said(text) == "True 3\nTrue"


def test_what_helpers_count_is_counted_here():
    text = """
    effort, t = Effort(), np.linspace(0.0, 1.0, 2)
    def count(item):
        time.sleep(0.05)
        Effort(within=effort).add(t, 100)
        effort.cut()
        return item, effort
    found = each(count, items, 3)
    print(effort.spent, effort.is_cut, all(one is effort for _, one in found))
    """
    assert said(text) == "1200 True True"


def test_an_error_is_raised_here_and_a_helper_that_dies_loses_nothing():
    text = """
    def fails(item):
        time.sleep(0.05)
        if item[1] == 9:
            raise ValueError("nine")
        return item
    try:
        each(fails, items, 3)
    except ValueError as error:
        print(error)
    def dies(item):
        time.sleep(0.05)
        if os.getpid() != here and item[1] > 6:
            os.kill(os.getpid(), 9)
        return item
    print(each(dies, items, 3) == items)
    """
    assert said(text) == "nine\nTrue"


def test_beside_threads_and_within_a_helper_it_does_not_fork():
    text = """
    import threading
    def nested(item):
        time.sleep(0.05)
        return {process for process, _ in each(slow, items[:3], 2)} == {os.getpid()}
    print(all(each(nested, items, 2)[1:]))  # the first is done alone
    hold = threading.Event()
    threading.Thread(target=hold.wait, daemon=True).start()
    print({process for process, _ in each(slow, items, 3)} == {here})
    """
    assert said(text) == "True\nTrue"


def test_one_job_or_one_item_needs_no_help():
    assert each(str, (1, 2), 1) == ["1", "2"] and each(str, [3], 8) == ["3"] and each(str, [], 8) == []
