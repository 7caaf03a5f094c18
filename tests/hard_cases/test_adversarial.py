"""The hardest training sets of earlier arithmetic; `make hard-cases` tries thousands more."""

import pytest

from tests.hard_cases.adversarial import corpus, judged
from tests.hard_cases.families import FAMILIES


@pytest.mark.parametrize(("family", "seed"), corpus())
def test_answers_are_those_of_whole_numbers_by_two_engines(family, seed):
    judgement = judged(family, seed, reference=True)
    assert (judgement.wrong, judgement.engines) == (0, 0), judgement


def test_the_corpus_has_every_family():
    assert {family for family, _ in corpus()} == set(FAMILIES)
