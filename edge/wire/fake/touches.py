"""Labelled touches for any skin: the demo's simulated contacts, mapped onto its
geometry.

The force on each taxel of a simulated contact is spread over the taxel's patch, and
added up on the patches of the other skin: the sum of the forces stays, and so do
lengths. Trials differ in place, strength and speed. They serve to rehearse before a
wire is soldered; a model fitted on them knows nothing of the real skin.
"""

import math
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from edge import demo
from edge.arrays import Floats
from edge.record.recording import Recording, load
from edge.touch.layout import SkinLayout
from edge.wire.fake.player import calibrated
from edge.wire.skin.decoder import taxel_map
from edge.wire.skin.file import SkinFile

PITCH_M = 0.01
"""Assumed pitch of a skin whose own is unknown."""
STRENGTH = (0.8, 1.25)
SPEED = (0.9, 1.1)
"""Ranges from which the factors of a trial's forces and speed are drawn."""
LEAD_S = 0.3
"""Time before the simulated contact begins."""
TAIL_S = 0.3
"""Time after it, during which its last forces go on: no touch ends within a decision's
window."""
LARGEST_RATIO = 0.4
"""Tangential over normal force at the end of a touch of a skin of three axes."""
GOLDEN_ANGLE = 2.39996
WEAKEST_ONSETS = 4.0
LEAST_ONSET = 10
"""Where counts per newton are unknown, the strongest taxel of the weakest contact has
the counts of this many onsets; an onset below the second number is taken to be that
number of counts."""


def touches(
    file: SkinFile,
    *,
    trials: int,
    seed: int = 0,
) -> Iterator[tuple[str, Recording]]:
    """Name and recording of each touch, for every contact of the demo.

    Args:
        file: the skin.
        trials: number of touches of each contact.
        seed: of place, strength and speed.
    """
    sources = [(path, load(path)) for path in demo.recordings()]

    def trial(kind: int, *number: int) -> tuple[Floats, Floats]:
        rng = np.random.default_rng([seed, kind, *number])
        return _mapped(sources[kind][1], file.layout, file.reading.rate_hz, rng)

    counts_per_newton = file.layout.counts_per_newton
    if counts_per_newton is None:
        weakest = min(trial(kind)[1].max() for kind in range(len(sources)))
        lowest_peak = WEAKEST_ONSETS * max(file.layout.onset, LEAST_ONSET)
        counts_per_newton = lowest_peak / weakest
    most = reach(file)
    covered = taxel_map(file).served.reshape(file.layout.shape)
    for number in range(trials):
        for kind, (path, source) in enumerate(sources):
            t, forces = trial(kind, number)
            counts = np.minimum(np.rint(forces * counts_per_newton), most)
            name = f"{path.stem}-{number:03}"
            meta = {
                "labels": source.labels,
                "skin": file.layout.to_dict(),
                "skin_name": file.name,
                "source": f"a simulated touch of the demo ({path.stem}), mapped onto "
                "this skin",
                "trial": name,
            }
            recording = Recording(
                t,
                counts.astype(np.uint16),
                valid=None if covered.all() else covered,
                meta=meta,
                shear=_shear(counts, number) if file.layout.axes else None,
            )
            yield name, recording


def _shear(counts: Floats, number: int) -> NDArray[np.int16]:
    """A pull of each taxel in proportion to its force, which grows and turns from trial
    to trial: it only shows where the arrows point."""
    grows = np.linspace(0.0, LARGEST_RATIO, len(counts))[:, None, None]
    pull = np.minimum(grows * counts, 32767.0)
    angle = (number + 0.5) * GOLDEN_ANGLE
    shear = [pull * math.cos(angle), pull * math.sin(angle)]
    return np.rint(np.stack(shear, axis=3)).astype(np.int16)


def still(file: SkinFile, seconds: float) -> Recording:
    """A recording of the skin while nothing touches it."""
    t = np.arange(max(1, round(seconds * file.reading.rate_hz))) / file.reading.rate_hz
    meta = {
        "labels": {},
        "skin": file.layout.to_dict(),
        "source": "nothing touches",
        "trial": 0,
    }
    frames = np.zeros((len(t), *file.layout.shape), np.uint16)
    shear = np.zeros((*frames.shape, 2), np.int16) if file.layout.axes else None
    return Recording(t, frames, meta=meta, shear=shear)


def reach(file: SkinFile) -> int:
    """The greatest count that a touch can give on every fake chip."""
    calibration = calibrated(file).calibration
    assert calibration is not None
    at_rest = calibration.baseline.ravel().tolist()
    return min(
        at_rest[taxel] - 1 if chip.sign < 0 else chip.traits.highest - at_rest[taxel]
        for chip in file.chips
        for taxel in chip.served
    )


def pitch(layout: SkinLayout) -> tuple[float, float]:
    """Metres between rows and between columns."""
    return (PITCH_M, PITCH_M) if layout.pitch_m is None else layout.pitch


def _mapped(
    source: Recording,
    onto: SkinLayout,
    rate_hz: float,
    rng: np.random.Generator,
) -> tuple[Floats, Floats]:
    """Times (n,) and forces (n, rows, cols) of one trial."""
    row, col = (rng.uniform(0.25, 0.75) * (n - 1) for n in onto.shape)
    if onto.wraps:
        col = rng.uniform(0.0, onto.cols)
    strength = rng.uniform(*STRENGTH)
    speed = rng.uniform(*SPEED)
    forces = strength * (source.frames / (source.layout.counts_per_newton or 1.0))
    lasts = float(source.t[-1] - source.t[0]) / speed
    t = np.arange(int((LEAD_S + lasts + TAIL_S) * rate_hz) + 1) / rate_hz
    at = (t - LEAD_S) * speed + source.t[0]
    frame = np.interp(at, source.t, np.arange(len(source.t)))
    former = np.minimum(frame.astype(int), len(source.t) - 2)
    share = (frame - former)[:, None, None]
    played = (1.0 - share) * forces[former] + share * forces[former + 1]
    played[at < source.t[0]] = 0.0
    middle_row, middle_col = _middle(forces)
    along = _spread(source.layout, onto, 0, middle_row, row)
    around = _spread(source.layout, onto, 1, middle_col, col)
    return t, along.T @ played @ around


def _middle(forces: Floats) -> tuple[float, float]:
    """Row and column of the centre of a contact's forces; the column on the circle."""
    total = forces.sum(axis=0)
    rows, cols = total.shape
    angle = np.exp(2j * math.pi * np.arange(cols) / cols)
    col = float(np.angle((total.sum(axis=0) * angle).sum())) * cols / (2.0 * math.pi)
    return float(total.sum(axis=1) @ np.arange(rows) / total.sum()), col


def _spread(
    source: SkinLayout,
    onto: SkinLayout,
    axis: int,
    middle: float,
    centre: float,
) -> Floats:
    """(sources, taxels) shares of each source row (axis 0) or column on each row or
    column.

    Sources and taxels are as wide as their pitch. The position `middle` of the sources
    is mapped to the position `centre` of the taxels.
    """
    sources = source.shape[axis]
    taxels = onto.shape[axis]
    offset = np.arange(sources) - middle
    if axis == 1 and source.wraps:
        offset = (offset + sources / 2.0) % sources - sources / 2.0
    ratio = pitch(source)[axis] / pitch(onto)[axis]
    starts = (centre + offset * ratio - ratio / 2.0)[:, None]
    edges = np.arange(taxels) - 0.5
    shares = np.zeros((sources, taxels))
    # A contact that is wider than the skin goes round it as often as it must.
    for turn in range(-2, 3) if axis == 1 and onto.wraps else range(1):
        low = edges + turn * taxels
        overlap = np.minimum(starts + ratio, low + 1.0) - np.maximum(starts, low)
        shares += np.maximum(0.0, overlap)
    return shares / ratio
