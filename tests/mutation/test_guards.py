"""The table of guards is up to date; `make mutants` takes each out."""

import pytest

from tests.mutation.guards import GUARDS


@pytest.mark.parametrize("guard", GUARDS, ids=lambda guard: guard.keeps)
def test_the_guard_is_found_in_one_place(guard):
    assert guard.job().text
