"""Fixtures that the tests of training share."""

import pytest

from train.__main__ import main


@pytest.fixture
def refusal(capsys):
    """The function that gives the sentence with which a command refuses what it is
    given."""

    def sentence(*words):
        assert main([*map(str, words)]) == 2
        *_, last = capsys.readouterr().err.replace("\r", "\n").strip().splitlines()
        assert last.startswith("edge-classify: ")
        return last

    return sentence
