"""Every reader, given anything: a recording or one sentence, never a traceback."""

from pathlib import Path

import bad_inputs
import pytest
from hypothesis import HealthCheck, given, settings

from ers_mj.data.formats import READERS

MILD = settings(
    derandomize=True, database=None, deadline=None, suppress_health_check=list(HealthCheck), print_blob=False
)


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    return tmp_path_factory.mktemp("bad")


@pytest.mark.filterwarnings("default")  # libraries warn of damaged files
@pytest.mark.parametrize("suffix", READERS)
def test_a_damaged_file_is_read_or_refused(suffix, folder):
    @settings(MILD, max_examples=15)
    @given(bad_inputs.damaged_files((suffix,)))
    def survives(file):
        bad_inputs.survived(folder / f"rec{file[0]}", file[1])

    survives()


@pytest.mark.parametrize("suffix", [".csv", ".parquet"])
def test_odd_columns_are_read_or_refused(suffix, folder):
    @settings(MILD, max_examples=60)
    @given(bad_inputs.tables())
    def survives(table):
        content = bad_inputs.written(table, suffix)
        if content is not None:
            bad_inputs.survived(folder / f"rec{suffix}", content)

    survives()


@settings(MILD, max_examples=60)
@given(bad_inputs.tables())
def test_odd_arrays_are_read_or_refused(table):
    bad_inputs.survived_columns(table)
