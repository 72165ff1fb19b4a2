"""What the pages point to exists."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
PAGES = [*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md"), *(ROOT / "mjcf").glob("*.md")]
LINK = re.compile(r"\]\(([^)#\s]+)[^)]*\)")
SCRIPT = re.compile(r"\b((?:ers_mj|analysis|tests)/[\w/]+\.py)\b")


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_every_relative_link_leads_somewhere(page):
    text = page.read_text()
    links = [link for link in LINK.findall(text) if ":" not in link]
    assert [link for link in links if not (page.parent / link).exists()] == []
    assert [path for path in SCRIPT.findall(text) if not (ROOT / path).exists()] == []


def test_every_result_that_is_kept_is_printed_on_a_page():
    """A file in analysis/results stands behind a figure: a page links it, or the page of identification its folder."""
    linked = "".join(page.read_text() for page in PAGES)
    elsewhere = ("identification_bars", "against_mujoco_sysid", "identify_time", "table_2", "whole_chain")
    kept = {path.name for path in (ROOT / "analysis" / "results").iterdir()}
    assert {name for name in kept if name not in linked and not name.startswith(elsewhere)} == set()
