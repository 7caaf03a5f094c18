"""Random numbers that stay where they are: one stream per name, condition and trial."""

from __future__ import annotations

import hashlib
from functools import cache

import numpy as np
from numpy.typing import NDArray


def key(name: str) -> tuple[int, int]:
    """Two 32-bit words that stand for `name` on every machine and in every run."""
    digest = hashlib.sha256(name.encode()).digest()
    return int.from_bytes(digest[:4], "little"), int.from_bytes(digest[4:8], "little")


def stream(seed: int, name: str, condition: str, trial: int | None = None) -> np.random.Generator:
    """The stream of `name` in one trial of `condition`; without `trial`, of the condition.

    Streams are told apart by name, never by position: adding an effect, an object or a trial
    leaves the draws of all others as they were.
    """
    words = (*key(name), *key(condition), *(() if trial is None else (trial,)))
    return np.random.Generator(np.random.PCG64(np.random.SeedSequence(seed, spawn_key=words)))


def draws(
    seed: int, name: str, condition: str, trials: NDArray[np.int64], kind: str
) -> NDArray[np.float64]:
    """One draw for each trial: the trial-th of the condition's stream of `name`.

    Args:
        trials: (n,) trial numbers, 0 and up.
        kind: `uniform` on [0, 1), or `normal` of mean 0 and deviation 1, cut at 2.5.
    """
    generator = stream(seed, name, condition)
    count = int(trials.max()) + 1
    if kind == "uniform":
        return generator.random(count)[trials]
    return np.clip(generator.standard_normal(count), -2.5, 2.5)[trials]


@cache
def quantiles() -> NDArray[np.float32]:
    """The normal law in 65,536 equal parts, to +-4.3 deviations."""
    from scipy.special import ndtri

    return np.asarray(ndtri((np.arange(65536) + 0.5) / 65536.0), dtype=np.float32)


def drawn(
    generator: np.random.Generator, table: NDArray[np.float32], shape: tuple[int, ...]
) -> NDArray[np.float32]:
    """Numbers of a table of 65,536 (`quantiles`, times a deviation), each by 16 random bits:
    several times faster than `standard_normal`, and finer than any taxel's reading."""
    count = int(np.prod(shape))
    words = generator.bit_generator.random_raw(-(-count // 4)).astype("<u8").view("<u2")[:count]
    # No word is beyond the table's end; told to wrap, numpy does not look.
    return np.take(table, words, mode="wrap").reshape(shape)
