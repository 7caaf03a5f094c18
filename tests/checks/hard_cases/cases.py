"""A hard case, and the search for the largest error of it."""

import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from hypothesis import HealthCheck, Phase, given, settings, target
from hypothesis import strategies as st
from threadpoolctl import threadpool_limits

EXAMPLES = 12
"""Examples that a search tries around a case; the same ones in every run."""
SEEDS = st.integers(0, 10**6)


@dataclass(frozen=True)
class Worst:
    """The largest error that was found.

    Attributes:
        error: the error.
        at: the parameters it was at; the first tried where all are equal.
        count: how many were tried.
    """

    error: float
    at: Mapping[str, Any]
    count: int


@dataclass(frozen=True)
class Ladder:
    """Values of one parameter, steps harder than the one before.

    Attributes:
        words: what it is, with its unit.
        values: from easy to hard.
        parameter: its name.
        recordings: where recordings lie on the same scale: the 856 grasps of SDH-2, and
            the simulated `cody18`.
        beside: other parameters that differ from those of the case's first hazard.
    """

    words: str
    values: Sequence[float]
    parameter: str
    recordings: str = ""
    beside: Mapping[str, Any] = field(default_factory=dict)


def decades(first, last, steps=2):
    """Powers of ten from one exponent to another, `steps` a decade."""
    count = round(abs(last - first) * steps) + 1
    return [10.0**e for e in np.linspace(first, last, count)]


def powers_of_ten(low, high):
    """Numbers between two powers of ten, by their exponents."""
    return st.floats(low, high).map(lambda e: 10.0**e)


@dataclass(frozen=True)
class Case:
    """A hazard with an oracle.

    Attributes:
        key: the kind of hazard, a colon, the hazard.
        oracle: what the answer is judged by.
        unit: what `error` measures.
        error: the error at given parameters.
        hazard: the parameters that the case is known by.
        around: strategies of parameters near them, which the search draws from.
        ladder: the search for the margin; None if all values are tried.
        usual: measures what the usual tools give on the same hazard, in words.
        examples: how many the search draws.
        bound: the largest error that is allowed.
    """

    key: str
    oracle: str
    unit: str
    error: Callable[..., float]
    hazard: Sequence[Mapping[str, Any]] = ({},)
    around: Mapping[str, Any] = field(default_factory=dict)
    ladder: Ladder | None = None
    usual: Callable[[], str] | None = None
    examples: int = EXAMPLES
    bound: float = 0.0

    # Decompositions of this size only lose by a second thread, most of all beside
    # others.
    @threadpool_limits.wrap(limits=1)
    def worst(self):
        """The largest error at the hazard and in the search around it."""
        errors = [(float(self.error(**at)), dict(at)) for at in self.hazard]
        if self.around:

            @settings(
                max_examples=self.examples,
                derandomize=True,
                database=None,
                deadline=None,
                phases=[Phase.generate, Phase.target],
                suppress_health_check=list(HealthCheck),
            )
            @given(**self.around)
            def search(**at):
                error = float(self.error(**at))
                errors.append((error, at))
                if error < float("inf"):
                    target(error)

            search()
        error, at = max(errors, key=lambda pair: pair[0])
        return Worst(error, at, len(errors))

    @threadpool_limits.wrap(limits=1)
    def theirs(self):
        """The answer of the usual tools, in words; "" without one."""
        if self.usual is None:
            return ""
        # It warns of some hazards; only its answer counts.
        with warnings.catch_warnings(), np.errstate(all="ignore"):
            warnings.simplefilter("ignore")
            return self.usual()
