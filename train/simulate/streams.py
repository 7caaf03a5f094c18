"""Random numbers that stay where they are: one stream per name, condition and trial."""

from __future__ import annotations

import hashlib
from functools import cache
from typing import Any

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
    state = _state(seed, *key(name), *key(condition), -1 if trial is None else trial)
    return np.random.Generator(np.random.PCG64(_Seed(state)))


class _Seed(np.random.SeedSequence):
    """A seed whose state has been computed already."""

    def __init__(self, state: NDArray[np.uint64]) -> None:
        """Of the four words that PCG64 asks for."""
        self.known = state

    def generate_state(self, n_words: int, dtype: Any = np.uint32) -> NDArray[Any]:
        """The four words."""
        return self.known


WORD = 0xFFFFFFFF


@njit(cache=True)
def _hashed(value: int, constant: int, factor: int) -> tuple[int, int]:
    """A word hashed, and the constant that hashes the next."""
    following = (constant * factor) & WORD
    value = ((value ^ constant) * following) & WORD
    return value ^ (value >> 16), following


@njit(cache=True)
def _state(seed: int, a: int, b: int, c: int, d: int, trial: int) -> NDArray[np.uint64]:
    """What `SeedSequence(seed, spawn_key=(a, b, c, d, trial))` makes of its words, or of all but
    the trial where that is negative, at a tenth of its time."""
    words = (seed & WORD, seed >> 32, 0, 0, a, b, c, d, trial)
    pool = np.zeros(4, dtype=np.int64)
    constant = 0x43B0D7E5
    for i in range(4):
        pool[i], constant = _hashed(words[i], constant, 0x931E8875)
    for i in range(9 if trial >= 0 else 8):
        for k in range(4):
            if k != i:
                value, constant = _hashed(pool[i] if i < 4 else words[i], constant, 0x931E8875)
                mixed = (0xCA01F9DD * pool[k] - 0x4973F715 * value) & WORD
                pool[k] = mixed ^ (mixed >> 16)
    state = np.zeros(4, dtype=np.int64)
    constant = 0x8B51F9DD
    for i in range(8):
        value, constant = _hashed(pool[i % 4], constant, 0x58F38DED)
        state[i // 2] |= value << (32 * (i % 2))
    return state.view(np.uint64)


def draws(
    seed: int, names: list[str], condition: str, trials: NDArray[np.int64], kind: str
) -> NDArray[np.float64]:
    """(names, n), a draw for each trial: the trial-th of the condition's stream of each name.

    Args:
        trials: (n,) trial numbers, 0 and up.
        kind: `uniform` on [0, 1), or `normal` of mean 0 and deviation 1, cut at `FARTHEST`.
    """
    drawn = np.empty((len(names), int(trials.max()) + 1))
    for row, name in zip(drawn, names, strict=True):
        generator = stream(seed, name, condition)
        (generator.random if kind == "uniform" else generator.standard_normal)(out=row)
    return np.clip(drawn, -FARTHEST, FARTHEST)[:, trials]


@cache
def quantiles(deviation: float = 1.0) -> NDArray[np.float32]:
    """The normal law in 65,536 equal parts, from -4.3 to 4.3 deviations."""
    from scipy.special import ndtri

    parts = np.asarray(ndtri((np.arange(65536) + 0.5) / 65536.0), dtype=np.float32)
    return parts * np.float32(deviation)


def add_drawn(
    generator: np.random.Generator,
    table: NDArray[np.float32],
    to: NDArray[np.float32],
    places: NDArray[np.intp],
    length: int,
) -> None:
    """Add to each number one of a table of 65,536 (`quantiles`), by 16 random bits: several times
    faster than `standard_normal`, and finer than any taxel's reading.

    Args:
        to: (rows, n), of rows that have `length` numbers each.
        places: (n,) where in a row they are; a place's draws are the same whichever others there
            are.
    """
    count = len(to) * length
    words = generator.bit_generator.random_raw(-(-count // 4)).astype("<u8", copy=False)
    _add_picked(words.view("<u2")[:count].reshape(-1, length), table, to, places)


@njit(cache=True)
def _add_picked(
    words: NDArray[np.uint16],
    table: NDArray[np.float32],
    to: NDArray[np.float32],
    places: NDArray[np.intp],
) -> None:
    for row in range(len(to)):
        for i in range(len(places)):
            to[row, i] += table[words[row, places[i]]]
