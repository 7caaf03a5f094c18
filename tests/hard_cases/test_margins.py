"""The table's margins are of cases that exist, and a search finds where a case begins to fail."""

from edge.errors import InputError
from tests.hard_cases.cases import Case
from tests.hard_cases.margins import LADDERS, LIE, Ladder, decades, margin, search
from tests.hard_cases.registry import CASES


def test_each_ladder_is_of_a_case_and_lies_on_a_known_scale():
    assert set(LADDERS) <= {case.key for case in CASES}
    assert {ladder.lie for ladder in LADDERS.values()} - {""} <= set(LIE)


def test_a_search_ends_at_the_first_failure():
    case = Case("g", "n", "", "", 0, lambda x: float(x >= 1e3))
    # Between 100 and 1000 it is narrowed down.
    assert search(case, Ladder("x", decades(0, 6, 1), lambda x: {"x": x})) == (900.0, 1e3, False)
    assert search(case, Ladder("x", [100, 1200], lambda x: {"x": x})) == (100, 1200, False)
    assert search(case, Ladder("x", [1.0, 2.0], lambda x: {"x": x})) == (2.0, None, False)
    assert search(case, Ladder("x", [1e4], lambda x: {"x": x})) == (None, 1e4, False)


def test_a_case_that_draws_holds_where_it_holds_with_every_seed():
    case = Case("g", "n", "", "", 0, lambda x, seed: float(x + seed >= 9))
    assert search(case, Ladder("x", [1, 4, 5, 9], lambda x: {"x": x, "seed": 0})) == (4, 5, False)


def test_a_refusal_is_no_wrong_answer():
    def refuse(x):
        raise InputError("too much")

    case = Case("g", "n", "", "", 0, refuse)
    assert search(case, Ladder("x", [1.0], lambda x: {"x": x})) == (None, 1.0, True)


def test_a_case_without_a_parameter_says_so():
    case = Case("g", "n", "", "", 0, lambda: 0.0)
    assert margin(case).startswith("no parameter")
