"""Kernels against a loop of Python's own integers."""

import zlib
from itertools import combinations, compress

import numpy as np
import pytest

from edge.config import ConfigTable
from edge.errors import InputError
from edge.features import kernels
from edge.features.kernels import (
    SAMPLES,
    KernelTable,
    channels_of,
    convolution_of_bias,
    kernel_channels,
    read_tables,
    shares,
    shifted,
)
from edge.features.vector import feature_vector
from edge.touch.layout import SkinLayout
from tests.edge.touch.pressed import followed, pressed

SKIN = SkinLayout(16, 24, threshold_counts=9)
HEAVY = list(combinations(range(9), 3))


def moved(value, shift):
    """A channel's value times 2^shift, cut off at 14 bits."""
    scaled = value << shift if shift > 0 else value >> -shift
    return min(scaled, (1 << 14) - 1)


def result(mixed, kernel, dilation, t):
    """The sum of a kernel's nine taps about a sample, with zeros beyond the ends."""
    total = 0
    for tap in range(9):
        at = t + (tap - 4) * dilation
        if 0 <= at < SAMPLES:
            total += (2 if tap in HEAVY[kernel] else -1) * mixed[at]
    return total


def by_hand(channels, table):
    """(above, counted) of every bias, in Python's integers."""
    rows = []
    for row, shift in zip(channels.tolist(), table.shifts, strict=True):
        rows.append([moved(value, shift) for value in row])
    mixes = kernels.mixes(len(rows)).astype(bool).tolist()
    convolutions = convolution_of_bias(len(table.biases)).tolist()
    counts = []
    for bias, convolution in zip(table.biases, convolutions, strict=True):
        level, kernel = divmod(convolution, 84)
        mixed = list(map(sum, zip(*compress(rows, mixes[convolution]), strict=True)))
        padded = (level + kernel) % 2 == 0
        reach = 0 if padded else 4 << level
        above = 0
        for t in range(reach, SAMPLES - reach):
            above += result(mixed, kernel, 1 << level, t) > bias
        counts.append((above, SAMPLES - 2 * reach))
    return counts


@pytest.mark.parametrize(("biases", "channels"), [(1008, 1), (504, 5)])
def test_every_share_is_that_of_a_loop_of_whole_numbers(biases, channels):
    rng = np.random.default_rng(biases + channels)
    values = rng.integers(0, 1 << 20, (channels, SAMPLES)) * rng.integers(0, 2, SAMPLES)
    table = KernelTable(
        tuple(rng.integers(-9, 3, channels).tolist()),
        tuple(rng.integers(-(1 << 15), 1 << 15, biases).tolist()),
    )
    expected = [above / counted for above, counted in by_hand(values, table)]
    assert shares(values, table).tolist() == expected
    assert len(set(expected)) > 20


@pytest.mark.slow  # aeon compiles its functions
@pytest.mark.parametrize(("biases", "channels"), [(1008, 32), (504, 36)])
def test_every_share_is_that_of_aeon_s_minirocket_with_the_same_kernels(
    biases, channels
):
    minirocket = pytest.importorskip(
        "aeon.transformations.collection.convolution_based._minirocket",
        reason="aeon is not installed",
    )
    rng = np.random.default_rng(biases)
    values = rng.integers(0, 1 << 12, (channels, SAMPLES))
    table = KernelTable(
        (2,) * channels, tuple(rng.integers(-(1 << 15), 1 << 15, biases).tolist())
    )
    mixes = kernels.mixes(channels)
    parameters = (
        mixes.sum(axis=1).astype(np.int32),
        np.nonzero(mixes)[1].astype(np.int32),
        np.array(kernels.DILATIONS, np.int32),
        np.array(kernels.BIASES[biases], np.int32),
        np.array(table.biases, np.float32),
    )
    touch = kernels.shifted(values, table.shifts)[None].astype(np.float32)
    (of_aeon,) = minirocket._static_transform_multi(
        touch,
        parameters,
        np.array(HEAVY, np.int32),
    )
    assert shares(values, table).astype(np.float32).tolist() == of_aeon.tolist()


def test_a_convolution_takes_the_same_channels_on_every_machine():
    assert (kernels.mixes(1) == 1).all()
    # A model stores none of them: other draws would change the features of a stored
    # model.
    assert (
        zlib.crc32(np.packbits(kernels.mixes(20).astype(bool)).tobytes()) == 1077911594
    )


def touch():
    """A press that grows; its frames come 10 ms apart and a little late."""
    patch = {(row, (3, 4, 5)) for row in (2, 3, 4)}
    return [
        pressed(
            SKIN,
            5.0 + 0.01 * i + 1e-9 * (i % 3),
            dict.fromkeys(patch, 10 + 7 * i % 50),
        )
        for i in range(SAMPLES)
    ]


def series_of(frames, *features):
    return followed(SKIN, frames, features=features).series()


@pytest.mark.parametrize(
    ("name", "channels"), [("taxel_kernels", 24), ("zone_kernels", 32)]
)
def test_a_channel_holds_the_last_frame_before_each_time(name, channels):
    frames = touch()
    held = kernel_channels(series_of(frames, name), 1.19, name)
    assert held.shape == (channels, SAMPLES) == (channels_of(name, SKIN), SAMPLES)
    # Frame i is 0.01 s i after the onset, at which sample i is mixes.
    forces = [int(frame.counts.sum()) for frame in frames]
    sums = held.sum(axis=0) if name == "taxel_kernels" else held[10]
    assert sums.tolist() == forces
    table = KernelTable(
        (0,) * channels, (0,) * {"taxel_kernels": 1008, "zone_kernels": 504}[name]
    )
    vector = feature_vector(
        series_of(frames, name),
        1.19,
        features=[name],
        tables={name: table},
    )
    assert vector.tolist() == shares(held, table).tolist()


def test_kernels_without_their_table_or_their_measurements_are_refused():
    series = series_of(touch(), "taxel_kernels")
    with pytest.raises(
        InputError, match="taxel_kernels needs a table that training made"
    ):
        feature_vector(series, 1.0, features=["taxel_kernels"])
    with pytest.raises(InputError, match="zone_kernels was not measured"):
        kernel_channels(series, 1.0, "zone_kernels")


@pytest.mark.parametrize(
    "wrong",
    [
        {"shifts": [0, 0], "biases": [0] * 1007},
        {"shifts": [0, 0], "biases": [1 << 22] * 1008},
    ],
)
def test_a_damaged_table_is_refused(wrong):
    skin = SkinLayout(1, 2)
    right = KernelTable((0, -3), (5,) * 1008)

    def read(table):
        tables = ConfigTable({"taxel_kernels": table}, "m")
        return read_tables(tables, ["taxel_kernels", "max_force"], skin)

    assert read(vars(right)) == {"taxel_kernels": right}
    with pytest.raises(InputError, match="^m: "):
        read(wrong)


def test_values_beyond_14_bits_are_cut_off_after_the_shift():
    channels = np.array([[16384, 1 << 60], [1 << 13, 1 << 60]])
    assert shifted(channels, (-4, 14)).tolist() == [[1024, 16383], [16383] * 2]
