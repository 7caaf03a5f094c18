"""Every hard case is within its bound, at the hazard and wherever the search looked."""

import pytest

from tests.hard_cases.registry import CASES


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.key)
def test_the_worst_is_within_the_bound(case):
    worst, at = case.worst()
    assert worst <= case.bound, f"{case.unit}: {worst} at {at}"


def test_the_table_has_no_row_twice():
    keys = [case.key for case in CASES]
    assert len(keys) == len(set(keys))
