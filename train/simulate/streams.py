"""Random numbers that stay where they are: one stream per name, condition and trial."""

from __future__ import annotations

import hashlib
from functools import cache

import numpy as np
from numba import njit
from numpy.typing import NDArray

FARTHEST = 2.5
"""Deviations from the middle that a normal draw lies at most."""


@cache
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
    # What SeedSequence(seed, spawn_key=words) makes of them itself, at twice its speed.
    entropy = np.zeros(4 + len(words), dtype=np.uint32)
    entropy[:2] = seed & 0xFFFFFFFF, seed >> 32
    entropy[4:] = words
    return np.random.Generator(np.random.PCG64(np.random.SeedSequence(entropy)))


def draws(
    seed: int, name: str, condition: str, trials: NDArray[np.int64], kind: str
) -> NDArray[np.float64]:
    """One draw for each trial: the trial-th of the condition's stream of `name`.

    Args:
        trials: (n,) trial numbers, 0 and up.
        kind: `uniform` on [0, 1), or `normal` of mean 0 and deviation 1, cut at `FARTHEST`.
    """
    generator = stream(seed, name, condition)
    count = int(trials.max()) + 1
    if kind == "uniform":
        return generator.random(count)[trials]
    return np.clip(generator.standard_normal(count), -FARTHEST, FARTHEST)[trials]


@cache
def quantiles() -> NDArray[np.float32]:
    """The normal law in 65,536 equal parts, to +-4.3 deviations."""
    from scipy.special import ndtri

    return np.asarray(ndtri((np.arange(65536) + 0.5) / 65536.0), dtype=np.float32)


def add_drawn(
    generator: np.random.Generator,
    table: NDArray[np.float32],
    to: NDArray[np.float32],
    but_to_zeros: bool = False,
) -> None:
    """Add to each number one of a table of 65,536 (`quantiles`, times a deviation), by 16 random
    bits: several times faster than `standard_normal`, and finer than any taxel's reading.

    Args:
        but_to_zeros: leave zeros as they are, and all others' draws too.
    """
    words = generator.bit_generator.random_raw(-(-to.size // 4)).astype("<u8", copy=False)
    _add_picked(words.view("<u2"), table, to.reshape(-1), but_to_zeros)


@njit(cache=True)
def _add_picked(
    words: NDArray[np.uint16],
    table: NDArray[np.float32],
    to: NDArray[np.float32],
    but_to_zeros: bool,
) -> None:
    for i in range(len(to)):
        if not but_to_zeros or to[i] != 0.0:
            to[i] += table[words[i]]
