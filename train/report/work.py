"""Work shared out to several processes, with a progress bar."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from joblib import Parallel, delayed
from threadpoolctl import threadpool_limits

from train.progress import bar


@dataclass(frozen=True)
class Workers:
    """The processes that a report is computed by.

    Attributes:
        jobs: number of processes.
        cluster: name of a joblib backend other than this machine's, if one is used.
        progress: show progress bars on stderr.
    """

    jobs: int = 1
    cluster: str | None = None
    progress: bool = True

    def map(
        self, what: str, function: Callable[..., Any], cases: Sequence[tuple[Any, ...]]
    ) -> list[Any]:
        """function(*case) of each case, in their order; `what` is the heading of the bar."""
        # Without memory maps, which would make arrays read-only files; these are small.
        run = Parallel(
            n_jobs=self.jobs, backend=self.cluster, return_as="generator", max_nbytes=None
        )
        results = run(delayed(_single)(function, case) for case in cases)
        return list(bar(results, total=len(cases), desc=f"{what:<22}", disable=not self.progress))


def _single(function: Callable[..., Any], case: tuple[Any, ...]) -> Any:
    with threadpool_limits(1):
        return function(*case)
