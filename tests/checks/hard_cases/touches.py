"""Kernels and moments of touches with large numbers."""

import numpy as np
from hypothesis import strategies as st

from edge.features.kernels import SAMPLES, KernelTable, shares
from edge.touch.frame import Frame
from edge.touch.layout import SkinLayout
from tests.checks.hard_cases.cases import SEEDS, Case, Ladder
from tests.edge.features.test_kernels import by_hand
from tests.edge.features.test_quantities import moments
from tests.edge.touch.pressed import quantities, zones_of


def kernels_error(bits, seed):
    """Shares of kernels on five channels of so many bits that are not those of a loop
    of whole numbers."""
    rng = np.random.default_rng(seed)
    channels = rng.integers(0, 1 << bits, (5, SAMPLES)) >> rng.integers(0, 9, (5, 1))
    shifts = (rng.integers(11, 16, 5) - bits).clip(-48, 14)
    biases = rng.integers(-(1 << 17), 1 << 17, 504)
    table = KernelTable(tuple(shifts.tolist()), tuple(biases.tolist()))
    expected = [above / counted for above, counted in by_hand(channels, table)]
    return float((shares(channels, table) != expected).sum())


def moments_error(rows, seed):
    """Largest error of the spreads, the slant and the length of random taxels of a skin
    with so many rows, over their size."""
    rng = np.random.default_rng(seed)
    layout = SkinLayout(rows, 8, False, threshold_counts=10)
    counts = rng.integers(11, 65536, layout.shape) * (rng.random(layout.shape) < 0.3)
    counts[rng.integers(rows), 0] = 65535
    frame = Frame(0.0, counts.astype(np.uint16))
    numbers = zones_of(layout, frame, ["skin_force"])["skin"]
    measured = quantities([numbers], layout)
    true = moments(np.c_[np.argwhere(counts), counts[counts > 0]].tolist())
    sizes = {name: true[name] for name in ("spread_along", "spread_around", "length")}
    sizes["slant"] = sizes["spread_along"] * sizes["spread_around"]
    errors = [abs(measured[n][0] - true[n]) / size for n, size in sizes.items() if size]
    return float(max(errors, default=0.0))


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
        {"rows": st.sampled_from([1, 2, 16, 300]), "seed": SEEDS},
        Ladder("rows of taxels", [16, 64, 256, 1024, 4096], "rows", "16 and 12"),
        bound=1e-15,
    ),
]
