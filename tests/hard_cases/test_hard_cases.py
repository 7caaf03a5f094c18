"""Every hard case is within its bound, at the hazard and wherever the search looked."""

import pytest

from tests.hard_cases.registry import CASES


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.key)
def test_the_worst_is_within_the_bound(case):
    worst = case.worst()
    assert worst.error <= case.bound, f"{case.unit}: {worst.error} at {worst.at}"


def test_the_table_has_no_row_twice():
    keys = [case.key for case in CASES]
    assert len(keys) == len(set(keys))


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.key)
def test_the_usual_stack_is_measured_or_the_table_says_why_not(case):
    assert callable(case.usual) or case.usual.startswith("does not apply: ")
