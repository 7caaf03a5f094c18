"""The table of guards is up to date; `make mutants` takes each out."""

import pytest

from tests.hard_cases.mutants import MUTANTS


@pytest.mark.parametrize("mutant", MUTANTS, ids=lambda m: m.guard)
def test_the_guard_is_found_exactly_once(mutant):
    assert not mutant.problem()
