"""Random numbers in one stream for each name, condition and trial."""

import hashlib
import struct
from functools import cache
from statistics import NormalDist

import numpy as np
from numpy.typing import NDArray

FARTHEST = 2.5
"""Largest distance of a normal draw from the mean, in deviations."""


@cache
def key(name: str) -> tuple[int, int]:
    """Two 32-bit words that identify `name` on every machine and in every run."""
    digest = hashlib.sha256(name.encode()).digest()
    first, second = struct.unpack_from("<2I", digest)
    return first, second


def stream(
    seed: int,
    name: str,
    condition: str,
    trial: int | None = None,
) -> np.random.Generator:
    """The stream of `name` in one trial of `condition`; without `trial`, of the
    condition.

    A stream depends on its name, never on its position: a further effect, object or
    trial changes no draw of the others.
    """
    words = (*key(name), *key(condition), *(() if trial is None else (trial,)))
    return np.random.Generator(
        np.random.PCG64(np.random.SeedSequence(seed, spawn_key=words))
    )


def draws(
    seed: int,
    name: str,
    condition: str,
    trials: NDArray[np.int64],
    kind: str,
) -> NDArray[np.float64]:
    """(n,) draws: the trial-th number of the condition's stream.

    Args:
        trials: (n,) trial numbers, 0 and up.
        kind: `random` on [0, 1), or `standard_normal`, cut at `FARTHEST`.
    """
    numbers = getattr(stream(seed, name, condition), kind)(int(trials.max()) + 1)
    return np.asarray(np.clip(numbers, -FARTHEST, FARTHEST)[trials])


@cache
def quantiles(deviation: float = 1.0) -> NDArray[np.float32]:
    """The normal quantiles of 65,536 equally likely intervals, from -4.3 to 4.3
    deviations."""
    upper = map(NormalDist().inv_cdf, ((np.arange(32768) + 32768.5) / 65536.0).tolist())
    positive = np.array(list(upper), dtype=np.float32)
    return np.concatenate([-positive[::-1], positive]) * np.float32(deviation)


def add_normal(
    generator: np.random.Generator,
    deviation: float,
    to: NDArray[np.float32],
) -> None:
    """Add to each number a normal draw, one of 65,536 `quantiles` that 16 random bits
    choose.

    This is several times faster than `standard_normal`, and finer than any taxel's
    reading.
    """
    words = generator.bit_generator.random_raw(-(-to.size // 4)).astype(
        "<u8", copy=False
    )
    to += quantiles(deviation)[words.view("<u2")[: to.size]].reshape(to.shape)
