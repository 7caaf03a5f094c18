"""Work shared among several processes, with a progress bar."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from joblib import Parallel, delayed

from edge.errors import InputError
from train.progress import bar
from train.threads import single_thread


@dataclass(frozen=True)
class Workers:
    """The processes that compute a report.

    Attributes:
        jobs: number of processes.
        progress: show progress bars on stderr.
    """

    jobs: int = 1
    progress: bool = True

    def __post_init__(self) -> None:
        """Refuse a number of processes that cannot work.

        Raises:
            InputError: it is below 1.
        """
        if self.jobs < 1:
            raise InputError(f"--jobs must be at least 1, not {self.jobs}")

    def map(
        self,
        heading: str,
        function: Callable[..., Any],
        cases: Sequence[tuple[Any, ...]],
    ) -> list[Any]:
        """The results of function(*case) in the order of the cases; the bar has the
        heading."""
        # Memory maps would make arrays read-only files, which pays only for large ones.
        run = Parallel(
            n_jobs=self.jobs,
            return_as="generator",
            max_nbytes=None,
        )
        results = run(delayed(_single)(function, case) for case in cases)
        return list(
            bar(
                results,
                total=len(cases),
                desc=f"{heading:<22}",
                disable=not self.progress,
            )
        )


def _single(function: Callable[..., Any], case: tuple[Any, ...]) -> Any:
    with single_thread():
        return function(*case)
