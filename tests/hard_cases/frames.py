"""Features of hard frames and times."""

import math
from fractions import Fraction

import numpy as np
import scipy.ndimage
from hypothesis import strategies as st

from edge.touch.features import feature_vector
from edge.touch.frame import Frame
from edge.touch.layout import SkinLayout
from edge.touch.region import largest_region
from edge.touch.track import ContactTracker
from tests.edge.touch.test_region import SHAPES, by_scipy, by_us
from tests.hard_cases.cases import SEEDS, Case, Ladder, decades, powers_of_ten

FULL_SCALE = "3554 and 24331"
FOREARM = SkinLayout(
    16,
    24,
    True,
    (0.0108, 0.01205),
    0.046,
    threshold_counts=50,
    onset_counts=50,
)


def region_error(density, peak, seed):
    """1 where a random frame with dead taxels has another region, area, peak or sums;
    of density 0 frames of one taxel that differ. `tests/edge/touch/test_region.py` has
    hard shapes."""
    rng = np.random.default_rng(seed)
    if density == 0.0:
        alone = [(taxels(at, value=peak), 50, None, True) for at in np.ndindex(16, 24)]
        return float(sum(by_us(*taxel) != by_scipy(*taxel) for taxel in alone))
    counts = rng.integers(51, peak + 1, (16, 24)) * (rng.random((16, 24)) < density)
    valid = rng.random((16, 24)) < 0.95
    arguments = counts.astype(np.uint16), 50, valid, bool(seed % 2)
    return float(by_us(*arguments) != by_scipy(*arguments))


def seam_usual():
    counts = SHAPES["seam"]
    labels, n = scipy.ndimage.label(counts > 50)
    largest = 1 + int(np.argmax([(labels == i + 1).sum() for i in range(n)]))
    col = np.nonzero(labels == largest)[1].mean()
    ours = largest_region(counts, 50).centroid[1]
    return f"scipy.ndimage.label: {n} regions, column {col:.2f}; ours column {ours:.2f}"


def contact_of(frames, layout=FOREARM, **options):
    """The first contact of some frames."""
    tracker = ContactTracker(layout, 1, **options)
    contact, *_ = [contact for frame in frames for contact in tracker.push(frame)]
    return contact


def taxels(*places, value=100):
    counts = np.zeros((16, 24), dtype=np.uint16)
    for row, col in places:
        counts[row, col % 24] = value
    return counts


def flicker_error(seed):
    """Metres that the followed centroid moves though nothing does: the peaks of two
    pairs of taxels take turns at being the higher one."""
    rng = np.random.default_rng(seed)
    frames = []
    for i in range(40):
        first, second = (101, 100) if i == 0 or rng.random() < 0.5 else (100, 101)
        counts = taxels((3, 5), (3, 6), value=first) + taxels(
            (12, 17),
            (12, 18),
            value=second,
        )
        frames.append(Frame(0.01 * i, counts))
    return float(np.abs(contact_of(frames).series().motion).max())


def times_error(seed, shortest):
    """Samples of a series with jitter, duplicates and gaps against exact interpolation,
    over the range of the counts and the resolution of the times."""
    rng = np.random.default_rng(seed)
    steps = 10.0 ** rng.uniform(math.log10(shortest), -0.5, 40)
    readings = np.cumsum(
        np.concatenate([[0.0], np.repeat(steps, rng.integers(1, 3, 40))])
    )
    readings = np.sort(np.concatenate([readings, readings[::5]]))  # some instants twice
    read = [(t, int(rng.integers(51, 65536))) for t in readings.tolist()]
    contact = contact_of(Frame(t, taxels((3, 3), value=peak)) for t, peak in read)
    vector = feature_vector(contact.series(), 1.2)[:40]
    latest = dict(read)
    t = list(latest)
    peaks = list(latest.values())
    worst = 0.0
    for sample, time in zip(
        vector.tolist(),
        (np.arange(40) * (1.2 / 39)).tolist(),
        strict=True,
    ):
        if time >= t[-1]:
            worst = max(worst, abs(sample - peaks[-1]) / 65536)
            continue
        i = int(np.searchsorted(t, time, side="right")) - 1
        step = Fraction(t[i + 1]) - Fraction(t[i])
        truth = peaks[i] + (Fraction(time) - Fraction(t[i])) / step * (
            peaks[i + 1] - peaks[i]
        )
        resolved = 1.0 + t[i + 1] / float(step)
        worst = max(worst, abs(float(Fraction(sample) - truth)) / 65536 / resolved)
    return worst


CASES = [
    Case(
        "features: regions of single taxels and of random frames, to full scale",
        "scipy.ndimage.label with the seam joined; plain integers",
        "frames that differ",
        region_error,
        [{"density": density, "peak": 65535, "seed": 0} for density in (0.0, 0.6)],
        {
            "density": st.floats(0.003, 1.0),
            "peak": st.integers(51, 65535),
            "seed": SEEDS,
        },
        Ladder(
            "counts",
            [255, 4095, 16383, 65535],
            "peak",
            FULL_SCALE,
            {"density": 0.6},
        ),
        seam_usual,
        examples=60,
    ),
    Case(
        "features: two regions of equal area that flicker",
        "nothing moves",
        "metres of motion",
        flicker_error,
        [{"seed": 0}],
        {"seed": SEEDS},
    ),
    Case(
        "features: jitter, duplicates and gaps in time",
        "interpolation in fractions; of one instant the last reading",
        "error over full scale and what the times resolve",
        times_error,
        [{"seed": 0, "shortest": 1e-12}],
        {"seed": SEEDS, "shortest": powers_of_ten(-12, -2)},
        Ladder("shortest step, s", decades(-3, -16), "shortest", "0.018, 0.010 s"),
        bound=1e-15,
    ),
]
