"""Convolution features in whole numbers: the share of a touch in which a kernel's sum
is large.

The kernels are those of MiniRocket (Dempster, Schmidt and Webb, 2021): nine taps, three
of them of weight 2 and six of weight -1, at four dilations. Each is applied to the sum
of a few channels of a touch. A feature is the share of the samples at which the result
is above a bias, and biases are values that training touches had. Everything up to that
share is a whole number below 2^21, so every machine finds the same bits.
"""

from __future__ import annotations

import random
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import combinations

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from edge.arrays import Booleans, Floats, Integers
from edge.config import ConfigTable
from edge.errors import InputError
from edge.features.names import not_measured
from edge.features.quantities import ALONE, KERNELS
from edge.features.zones import ZONE_WIDTH, ZONES, ZoneSeries
from edge.touch.contact import CLOCK_ROUNDING_S, FeatureSeries
from edge.touch.layout import SkinLayout

SAMPLES = 120
"""Times of the window at which a channel is taken: 100 a second in the usual window.
Fast changes escape fewer of them."""
TAPS = 9
BITS = 14
"""Bits of a channel's values; larger values are cut off."""
BIAS_BITS = 21
"""Bits of a bias: 9 channels times 12, the sum of a kernel's weights, times
2^`BITS`."""
LOWEST = -(2**BIAS_BITS)
"""Least bias; no result is above it where a sample does not count."""
WEIGHTS = np.array(
    [
        [2 if tap in heavy else -1 for tap in range(TAPS)]
        for heavy in combinations(range(TAPS), 3)
    ],
    dtype=np.int32,
)
"""(84, 9) weights."""
DILATIONS = (1, 2, 4, 8)
"""Samples from one tap to the next."""
BIASES = {1008: (5, 3, 2, 2), 504: (3, 1, 1, 1)}
"""Numbers of biases that a feature may have, and how many of them a kernel has at each
dilation."""
CONVOLUTIONS = len(DILATIONS) * len(WEIGHTS)
MIXED = (1, 1, 1, 2, 2, 3, 4, 6, 9)
"""How many channels a convolution may sum up; each entry is as likely as the others."""
SEED = 2021
"""Seed of the draw of the channels that each convolution sums up."""


@dataclass(frozen=True)
class KernelTable:
    """The shifts and biases that training found for the kernels of one feature.

    Attributes:
        shifts: of each channel, whose values are multiplied by 2^shift and lose their
            fractions.
        biases: of every kernel, in the order of `convolution_of_bias`.
    """

    shifts: tuple[int, ...]
    biases: tuple[int, ...]


def read_tables(
    tables: ConfigTable,
    names: Sequence[str],
    layout: SkinLayout,
) -> dict[str, KernelTable]:
    """{feature: its table} of the features that have one, from a model's metadata.

    Raises:
        InputError: a table has another number of channels or biases.
    """
    read = {}
    for name in names:
        if name in KERNELS:
            table = tables.table(name)
            channels = channels_of(name, layout)
            shifts = table.numbers("shifts", channels, low=-48, high=BITS)
            limits = table.numbers("biases", KERNELS[name], low=LOWEST, high=-LOWEST)
            table.refuse_unknown()
            read[name] = KernelTable(tuple(map(int, shifts)), tuple(map(int, limits)))
    return read


@lru_cache
def convolution_of_bias(biases: int) -> Integers:
    """(biases,) the convolution that each bias belongs to, from the number of
    biases."""
    repeats = np.repeat(BIASES[biases], len(WEIGHTS))
    return np.repeat(np.arange(CONVOLUTIONS), repeats)


@lru_cache
def _inside() -> Booleans:
    """(convolutions, samples) whether a sample counts.

    Every other kernel counts only where all its taps lie inside the window; the rest
    count everywhere, with zeros beyond the window's ends.
    """
    inside = np.ones((len(DILATIONS), len(WEIGHTS), SAMPLES), dtype=np.bool_)
    for i, dilation in enumerate(DILATIONS):
        reach = dilation * (TAPS // 2)
        inside[i, 1 - i % 2 :: 2, :reach] = inside[i, 1 - i % 2 :: 2, -reach:] = False
    return inside.reshape(CONVOLUTIONS, SAMPLES)


@lru_cache
def _samples_of_bias(biases: int) -> Integers:
    """(biases,) how many samples count, from the number of biases."""
    samples = np.count_nonzero(_inside(), axis=1)
    return np.asarray(samples[convolution_of_bias(biases)])


@lru_cache
def mixes(channels: int) -> NDArray[np.float32]:
    """(convolutions, channels) 1 where a convolution takes a channel.

    Python promises that `random` gives the same numbers in every version.
    """
    draw = random.Random(SEED).random
    mixes = np.zeros((CONVOLUTIONS, channels), dtype=np.float32)
    for row in mixes:
        left_over = list(range(channels))
        for _ in range(min(MIXED[int(draw() * len(MIXED))], channels)):
            row[left_over.pop(int(draw() * len(left_over)))] = 1.0
    return mixes


def shifted(channels: Integers, shifts: Sequence[int]) -> NDArray[np.int32]:
    """Channels (..., c, samples) times powers of two, cut off at the largest number of
    `BITS` bits."""
    by = np.array(shifts)[:, None]
    scaled = np.minimum(channels, 1 << 48) << np.maximum(by, 0) >> np.maximum(-by, 0)
    return np.asarray(np.minimum(scaled, (1 << BITS) - 1), dtype=np.int32)


def convolved(channels: NDArray[np.int32]) -> NDArray[np.int32]:
    """(..., convolutions, samples) results of `shifted` channels (..., c, samples)."""
    # Sums of nine such numbers are below 2^18: float32 holds them exactly, whatever the
    # order.
    mixed = (mixes(channels.shape[-2]) @ channels.astype(np.float32)).astype(np.int32)
    touches = channels.shape[:-2]
    mixed = mixed.reshape(*touches, len(DILATIONS), len(WEIGHTS), SAMPLES)
    results = np.empty_like(mixed)
    for i, dilation in enumerate(DILATIONS):
        reach = dilation * (TAPS // 2)
        padded = np.zeros((*touches, len(WEIGHTS), SAMPLES + 2 * reach), dtype=np.int32)
        padded[..., reach:-reach] = mixed[..., i, :, :]
        taps = sliding_window_view(padded, 2 * reach + 1, axis=-1)[..., ::dilation]
        np.einsum("kt,...kst->...ks", WEIGHTS, taps, out=results[..., i, :, :])
    return results.reshape(*touches, CONVOLUTIONS, SAMPLES)


def shares(channels: Integers, table: KernelTable) -> Floats:
    """(..., biases) share of the samples at which each kernel's result is above its
    bias.

    Args:
        channels: (..., c, samples) whole numbers from 0.
        table: of training.
    """
    results = convolved(shifted(channels, table.shifts))
    results[..., ~_inside()] = LOWEST
    biases = len(table.biases)
    of_bias = results[..., convolution_of_bias(biases), :]
    above = of_bias > np.array([table.biases], np.int32).T
    counts = np.count_nonzero(above, axis=-1)
    return np.asarray(counts / _samples_of_bias(biases))


def shares_of(
    series: FeatureSeries,
    windows_s: Floats,
    frames: Integers,
    name: str,
    tables: Mapping[str, KernelTable],
) -> Floats:
    """(windows, biases) the `shares` of a feature in a contact's windows, by its table.

    Raises:
        InputError: the feature was not measured, or has no table.
    """
    channels = kernel_channels(series, windows_s, name, frames)
    if name not in tables:
        raise InputError(f"{name} needs a table that training made")
    return shares(channels, tables[name])


def kernel_channels(
    series: FeatureSeries,
    window_s: float | Floats,
    name: str,
    frames: Integers | None = None,
) -> Integers:
    """(..., channels, `SAMPLES`) numbers to which a feature's kernels are applied.

    The last value before each time is held, and nothing is interpolated, so all are
    whole numbers.

    Args:
        series: the contact, as `FeatureSeries.felt` gives it.
        window_s: (...) seconds from onset.
        name: of the feature.
        frames: (...) of the contact that count in each window; all where None.

    Raises:
        InputError: the feature was not measured.
    """
    rows = ALONE[name].measure(ZoneSeries(series, "skin"))
    if rows is None:
        raise not_measured(name)
    steps = np.asarray(window_s)[..., None] / (SAMPLES - 1)
    times = np.arange(SAMPLES) * steps + CLOCK_ROUNDING_S
    held = series.t.searchsorted(times, side="right")
    if frames is not None:
        held = np.minimum(held, frames[..., None])
    return np.asarray(np.swapaxes(rows[held - 1], -1, -2))


def channels_of(name: str, layout: SkinLayout) -> int:
    """Number of channels to which the kernels of a feature are applied."""
    cells = ALONE[name].cells
    return cells(layout).count if cells else ZONE_WIDTH * len(ZONES)
