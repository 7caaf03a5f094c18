"""Work shared among several processes, with a progress bar."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from joblib import delayed

from train.threads import in_processes, single_thread


@dataclass(frozen=True)
class Workers:
    """The processes that compute a report.

    Attributes:
        jobs: number of processes.
    """

    jobs: int = 1

    def map(
        self,
        heading: str,
        function: Callable[..., Any],
        cases: Sequence[tuple[Any, ...]],
    ) -> list[Any]:
        """The results of function(*case) in the order of the cases; the bar has the
        heading."""
        calls = [delayed(_single)(function, case) for case in cases]
        # Memory maps would make arrays read-only files, which pays only for large ones.
        return list(in_processes(self.jobs, calls, heading, max_nbytes=None))


def _single(function: Callable[..., Any], case: tuple[Any, ...]) -> Any:
    with single_thread():
        return function(*case)
