"""Figures in README.md and docs/recipes.md are those of the measured tables."""

import re

import pytest

from edge.features.vector import WINDOW_S
from tests.checks.bench import tables
from tests.checks.hard_cases.registry import CASES
from tests.conftest import ROOT
from train.choose.decision_points import STEPS_S
from train.model.rules import RISK, TEST_SHARE, upper_limit

PAGES = ("README.md", "docs/recipes.md")
FIGURE = re.compile(
    r"\d[\d.,]* ?(?:%|per cent|percentage points|s\b|seconds|minutes|MB|kB)"
)
CODE = re.compile(r"(?ms)^ *```.*?^ *```|`[^`]*`")
TABLES = {path.stem: path.read_text() for path in sorted(tables.FOLDER.glob("*.md"))}


def figures(page):
    prose = CODE.sub("", (ROOT / page).read_text())
    return FIGURE.findall(" ".join(prose.split()))


def computed():
    """Figures that no table holds, because they follow from the code."""
    figures = {f"{WINDOW_S:g} seconds", f"{STEPS_S[0]:g} seconds", "1 MB"}
    for trials in (42, 299):
        certified = upper_limit(0, trials, TEST_SHARE * RISK)
        figures.add(f"{100 * certified:.0f} %")
    return figures


@pytest.mark.parametrize("page", PAGES)
def test_each_figure_is_measured_or_computed(page):
    text = "\n".join(TABLES.values())
    unexplained = []
    for figure in figures(page):
        number = re.escape(re.match(r"[\d.,]*\d", figure)[0])
        measured = re.search(rf"(?<![\d.]){number}(?![\d])", text)
        if measured is None and figure not in computed():
            unexplained.append(figure)
    assert unexplained == []


@pytest.mark.parametrize("name", TABLES)
def test_each_table_names_its_command_commit_machine_and_date(name):
    """The commit without local changes: otherwise nobody can say what was measured."""
    head = TABLES[name].splitlines()[0]
    command = r"`(make|python|edge-classify).*`"
    assert re.fullmatch(rf"\*{command}, commit .+, .+ cores, \d{{4}}-\d\d-\d\d\*", head)
    assert "-dirty" not in head


def test_each_table_is_on_a_page_and_each_link_has_its_table():
    pages = [ROOT / "docs" / name for name in ("measured.md", "hard-cases.md")]
    text = "\n".join(page.read_text() for page in pages)
    linked = re.findall(r"^\[[^\]]+\]\(measured/([\w-]+)\.md\)$", text, re.M)
    assert sorted(linked) == sorted(TABLES)


def test_every_hard_case_is_in_its_table():
    _, *markdown_tables = TABLES["hard_cases"].rstrip().split("\n\n")
    assert len(markdown_tables) == 2
    for part in markdown_tables:
        names = [row.split(" | ")[0].removeprefix("| ") for row in part.splitlines()]
        assert names[2:] == [case.key for case in CASES]
