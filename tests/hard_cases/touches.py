"""Kernels, moments and shear of touches with large numbers."""

from fractions import Fraction

import mpmath
import numpy as np
from hypothesis import strategies as st
from mpmath import mpf

from edge.touch.frame import Frame
from edge.touch.kernels import SAMPLES, KernelTable, shares
from edge.touch.layout import SkinLayout
from edge.touch.zones import quantities
from tests.edge.touch.pressed import zones_of
from tests.edge.touch.test_kernels import by_hand
from tests.hard_cases.cases import SEEDS, Case, Ladder

COLS = 8
PITCH = (0.01, 0.02)


def kernels_error(bits, seed):
    """Shares of kernels on five channels of so many bits that are not those of a loop
    of whole numbers."""
    rng = np.random.default_rng(seed)
    channels = rng.integers(0, 1 << bits, (5, SAMPLES)) >> rng.integers(0, 9, (5, 1))
    shifts = np.clip(rng.integers(11, 16, 5) - bits, -48, 14)
    biases = rng.integers(-(1 << 17), 1 << 17, 504)
    table = KernelTable(tuple(shifts.tolist()), tuple(biases.tolist()))
    expected = [above / counted for above, counted in by_hand(channels, table)]
    return float((shares(channels, table) != expected).sum())


def zone(rows, seed):
    """The layout, and the counts and shear of random taxels of a skin with so many
    rows."""
    rng = np.random.default_rng(seed)
    shape = (rows, COLS)
    layout = SkinLayout(rows, COLS, False, PITCH, threshold_counts=10, axes=3)
    counts = rng.integers(11, 65536, shape) * (rng.random(shape) < 0.3)
    counts[rng.integers(0, rows), 0] = 65535
    shear = rng.integers(-32768, 32768, (*shape, 2))
    frame = Frame(0.0, counts.astype(np.uint16), shear=shear.astype(np.int16))
    numbers = zones_of(layout, frame, ["skin_force", "skin_twist"])["skin"]
    places = [(int(row), int(col)) for row, col in np.argwhere(counts)]
    weights = [int(counts[place]) for place in places]
    forces = [tuple(map(int, shear[place])) for place in places]
    values = quantities(np.array([numbers]), layout)
    return places, weights, forces, {name: v[0] for name, v in values.items()}


def mean(values, weights):
    """The weighted mean, as a fraction."""
    total = sum(v * w for v, w in zip(values, weights, strict=True))
    return Fraction(total) / sum(weights)


def moments_error(rows, seed):
    """Largest error of a zone's spreads, slant and length, over their size."""
    places, weights, _, measured = zone(rows, seed)
    along, around = zip(*places, strict=True)
    row, col = mean(along, weights), mean(around, weights)
    rr = mean([(r - row) ** 2 for r in along], weights)
    cc = mean([(c - col) ** 2 for c in around], weights)
    rc = mean([(r - row) * (c - col) for r, c in places], weights)
    with mpmath.workdps(50):
        high, wide, slant = (mpf(v.numerator) / v.denominator for v in (rr, cc, rc))
        root = mpmath.sqrt((high - wide) ** 2 + 4 * slant**2)
        length = mpmath.sqrt((high + wide + root) / 2)
        spreads = mpmath.sqrt(high), mpmath.sqrt(wide)
        true = {
            "spread_along": (spreads[0], spreads[0]),
            "spread_around": (spreads[1], spreads[1]),
            "slant": (slant, spreads[0] * spreads[1]),
            "length": (length, length),
        }
        errors = [
            abs(mpf(float(measured[name])) - value) / size if size else mpf(0)
            for name, (value, size) in true.items()
        ]
        return float(max(errors))


def shear_error(rows, seed):
    """Error of the twist, over the size of its two parts."""
    places, weights, forces, measured = zone(rows, seed)
    along, around = zip(*places, strict=True)
    row, col = mean(along, weights), mean(around, weights)
    pairs = list(zip(places, forces, strict=True))
    first = sum((r - row) * around for (r, _), (_, around) in pairs)
    second = sum((c - col) * along for (_, c), (along, _) in pairs)
    parts = first * Fraction(PITCH[0]), second * Fraction(PITCH[1])
    error = abs(Fraction(float(measured["twist"])) - (parts[0] - parts[1]))
    return float(error / (sum(map(abs, parts)) or 1))


LONGER = Ladder("rows of taxels", [16, 64, 256, 1024, 4096], "rows", "16 and 12")
LENGTHS = {"rows": st.sampled_from([1, 2, 16, 300]), "seed": SEEDS}

CASES = [
    Case(
        "kernels: channels of many bits, shifted and cut off",
        "a loop of Python's whole numbers",
        "shares that differ",
        kernels_error,
        [{"bits": 40, "seed": 0}],
        {"bits": st.integers(1, 48), "seed": SEEDS},
        Ladder("bits", [8, 16, 32, 48, 62], "bits", "up to 30"),
        examples=6,
    ),
    Case(
        "moments: spreads, slant and length of scattered taxels",
        "fractions, roots to 50 digits",
        "error over the size",
        moments_error,
        [{"rows": 16, "seed": 0}],
        LENGTHS,
        LONGER,
        bound=1e-15,
    ),
    Case(
        "shear: the twist of scattered taxels",
        "fractions",
        "error over its two parts",
        shear_error,
        [{"rows": 16, "seed": 0}],
        LENGTHS,
        LONGER,
        bound=1e-15,
    ),
]
