"""Transforms and summaries of a feature's samples."""

from collections.abc import Sequence

import numpy as np

from edge.arrays import Array, Floats
from edge.elementary import log
from edge.features.names import Feature
from edge.touch.layout import SkinLayout


def transformed(
    values: Array,
    group: Sequence[Feature],
    layout: SkinLayout,
) -> Array:
    """Samples (rows, windows, times) after the transforms of their features, which are
    of one kind."""
    floors = np.array([[[feature.quantity.floor(layout)]] for feature in group])
    first = group[0]
    for transform in first.transforms:
        values = _transformed(values, transform, floors, first.quantity.wide)
        floors = np.ones_like(floors)
    return values


def _transformed(
    values: Floats,
    transform: str,
    floors: Floats,
    wide: bool,
) -> Floats:
    """A transform of samples (rows, windows, times); `wide` rows are those of one
    feature."""
    if transform == "log":
        above = values + floors
        return np.asarray(log(np.where(above > 0.0, above, 1.0)))
    if transform == "sqrt":
        return np.asarray(np.copysign(np.sqrt(np.abs(values)), values))
    # The cells or joints of one feature share one largest value.
    largest = np.abs(values).max(axis=(0, 2) if wide else 2, keepdims=True)
    shares = np.zeros_like(values)
    return np.asarray(np.divide(values, largest, out=shares, where=largest > 0.0))


def summarised(
    values: Floats,
    summary: str,
    steps_s: Floats,
) -> Array:
    """A summary of samples (rows, windows, times) that are `steps_s` (windows, 1)
    apart."""
    if summary == "rate":
        rates = np.empty_like(values)
        rates[..., 1:-1] = (values[..., 2:] - values[..., :-2]) / (2.0 * steps_s)
        rates[..., [0, -1]] = np.diff(values)[..., [0, -1]] / steps_s
        return rates
    if summary == "mean":
        return np.asarray(values.mean(axis=-1))
    if summary == "deviation":
        # Powers of two change no digit, and keep the squares within the range of
        # floats.
        power = np.frexp(np.abs(values).max(axis=-1, keepdims=True))[1]
        deviation = np.ldexp(values, -power).std(axis=-1)
        return np.asarray(np.ldexp(deviation, power[..., 0]))
    if summary == "roughness":
        return np.asarray(np.abs(np.diff(values)).mean(axis=-1))
    return values
