"""Fixtures that the checks of the board share with each other and with tests/."""

import pytest

from tests.board.debian import CHECKOUT
from tests.conftest import exported, recordings

__all__ = ["exported", "recordings", "wheel"]


@pytest.fixture(scope="session")
def wheel():
    """The wheel that `make wheel` built."""
    (wheel,) = (CHECKOUT / "dist").glob("edge_classify-*.whl")
    return wheel
