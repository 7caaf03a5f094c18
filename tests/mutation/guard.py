"""A guard, and what is left without it."""

from __future__ import annotations

from dataclasses import dataclass

from tests.mutation import runner, shapes


@dataclass(frozen=True)
class Guard:
    """A guard and what is left without it.

    Attributes:
        keeps: what it keeps from happening.
        stood: `file:function` where it stood when this was written; a hint, no condition.
        shape: its code, as `shapes.find` takes it.
        without: what takes its place.
        case: a `-k` expression of the hard cases to ask first.
        beside: a module whose tests are to be asked first.
    """

    keeps: str
    stood: str
    shape: str
    without: str
    case: str = ""
    beside: str = ""

    def job(self) -> runner.Job:
        """The change, and the tests that are asked about it.

        Raises:
            LookupError: the guard is not found.
        """
        match = shapes.find(self.shape, self.stood)
        first: list[tuple[str, ...]] = [(runner.HARD, "-k", self.case)] if self.case else []
        if self.beside and (shapes.ROOT / runner.mirror(self.beside)).exists():
            first.append((runner.mirror(self.beside),))
        text = shapes.without(match, self.without)
        return runner.Job(self.keeps, match.file, text, runner.stages(match.file, first))
