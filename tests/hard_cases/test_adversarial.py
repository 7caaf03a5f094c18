"""The hardest training sets found so far; `make hard-cases` looks for harder ones."""

import pytest

from tests.hard_cases.adversarial import corpus, judged
from tests.hard_cases.families import FAMILIES


@pytest.mark.parametrize(("family", "seed"), corpus())
def test_neighbours_and_label_are_the_exact_ones_or_flagged_as_close(family, seed):
    found = judged(family, seed)
    assert (found.wrong, found.missed) == (0, 0.0), f"{found.wrong} of {found.queries}"


def test_the_corpus_has_every_family():
    assert {family for family, _ in corpus()} == set(FAMILIES)
