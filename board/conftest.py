"""The fixtures of tests/ that the checks of the board share."""

from tests.conftest import exported, recordings

__all__ = ["exported", "recordings"]
