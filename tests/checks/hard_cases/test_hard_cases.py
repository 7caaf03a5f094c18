"""Every hard case is within its bound, and the table's margins are found by search."""

import pytest

from edge.errors import InputError
from tests.checks.hard_cases.cases import Case, Ladder, decades
from tests.checks.hard_cases.margins import margin
from tests.checks.hard_cases.registry import CASES


@pytest.mark.slow
@pytest.mark.parametrize("case", CASES, ids=lambda case: case.key)
def test_the_largest_error_is_within_the_bound(case):
    worst = case.worst()
    assert worst.error <= case.bound, f"{case.unit}: {worst.error} at {worst.at}"


def refuse(x):
    raise InputError("too much")


@pytest.mark.parametrize(
    ("error", "values", "words"),
    [
        (
            lambda x: float(x >= 1e3),
            decades(0, 6, 1),
            "x: holds to 100, fails from 1000",
        ),
        (refuse, [1.0], "x: refused with a sentence from 1"),
    ],
)
def test_a_margin_ends_at_the_first_failure(error, values, words):
    case = Case("", "", "", error, ladder=Ladder("x", values, "x"))
    assert margin(case) == words


def test_a_case_that_draws_holds_only_if_it_holds_with_every_seed():
    ladder = Ladder("x", [1, 4, 5, 9], "x", "3", {"seed": 0})
    case = Case("", "", "", lambda x, seed: float(x + seed >= 9), ladder=ladder)
    assert margin(case) == "x: holds to 4, fails from 5; recordings lie at 3"
