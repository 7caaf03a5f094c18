"""The fixture that the tests of importers share."""

import pytest


@pytest.fixture
def folder(tmp_path):
    """An empty folder with a place beside it."""
    (tmp_path / "in").mkdir()
    return tmp_path / "in"
