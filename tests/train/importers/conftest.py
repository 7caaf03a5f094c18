"""Fixtures that the tests of importers share."""

import pytest


@pytest.fixture
def folder(tmp_path):
    """An empty folder with a place beside it."""
    (tmp_path / "in").mkdir()
    return tmp_path / "in"


@pytest.fixture
def refused(refusal, tmp_path):
    """The function that gives the sentence with which an import writes nothing."""

    def sentence(kind, path, *options):
        out = tmp_path / "out"
        message = refusal("import", kind, path, "--out", out, *options)
        assert not out.exists() or not list(out.iterdir())
        return message

    return sentence
