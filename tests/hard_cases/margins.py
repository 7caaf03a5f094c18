"""Where each case begins to fail, found by search, beside where recordings lie; and what the guards
cost."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

from edge.errors import EdgeError
from edge.touch.arm import Chain
from edge.touch.features import feature_vector
from edge.touch.frame import Frame
from edge.touch.region import largest_region
from edge.touch.track import ContactTracker, TrackSettings
from tests.hard_cases.cases import Case
from tests.hard_cases.frames import FOREARM
from tests.hard_cases.limits import FAMILY_GROUP
from tests.hard_cases.models import (
    Ours,
    converted,
    features,
    labels_for,
    microseconds,
    session,
    usual_pipeline,
)


@dataclass(frozen=True)
class Ladder:
    """Values of one parameter, each harder than the one before.

    Attributes:
        what: the parameter, in words with its unit.
        values: from easy to hard.
        at: the case's parameters for a value.
        lie: where recordings lie on the same scale, a key of `lies`.
    """

    what: str
    values: Sequence[float]
    at: Callable[[float], Mapping[str, Any]]
    lie: str = ""


def decades(first: float, last: float, each: int = 2) -> list[float]:
    """Powers of ten from one exponent to another, `each` steps a decade."""
    count = round(abs(last - first) * each) + 1
    return [10.0**e for e in np.linspace(first, last, count)]


def seeded(name: str, **more: Any) -> Callable[[float], Mapping[str, Any]]:
    """The value under a name, beside others."""
    return lambda value: {name: value, **more}


FAILED, REFUSED = "fails", "refused with a sentence"
SEEDS = range(5)

LADDERS: dict[str, Ladder] = {
    "neighbours: distances of near-duplicates": Ladder(
        "spread over norm", decades(-2, -12, 1), seeded("spread", seed=0), "gap"
    ),
    "neighbours: offset 1e6, deviation 0.01": Ladder(
        "offset over deviation",
        decades(6, 17, 1),
        lambda ratio: {"offset": ratio * 0.01, "sd": 0.01, "seed": 0},
        "offset",
    ),
    "neighbours: scales 1e-24 to 1e+20": Ladder(
        "scale", decades(20, 170, 0.1), seeded("scale", seed=0), "scale"
    ),
    "neighbours: vote ties with even k": Ladder(
        "neighbours that vote", [2, 8, 32, 160], seeded("k", seed=0)
    ),
    "neighbours: equal distances": Ladder(
        "training rows", [160, 1400], seeded("n", seed=0), "rows"
    ),
    "neighbours: exact duplicates": Ladder(
        "training rows", [160, 1400], seeded("n", seed=0), "rows"
    ),
    "neighbours: queries outside the training set: cut off, and flagged": Ladder(
        "distance over range", decades(0, 160, 0.1), seeded("factor", seed=0), "far"
    ),
    "PCA: singular values over 15 decades": Ladder(
        "columns of the Hadamard matrix", [2, 4, 8, 12, 16], seeded("count", top=48, seed=0)
    ),
    "PCA: nearly equal eigenvalues at the cut": Ladder(
        "relative gap", decades(-1, -16, 1), seeded("gap", seed=0), "cut"
    ),
    "features: length, width, spread and slant of what touches, counts at full scale": Ladder(
        "counts",
        [60, 4095, 16383, 65535],
        lambda value: {"name": "steep", "value": value, "seed": 0},
        "counts",
    ),
    "kinematics: a sender that wraps its angles between two lines": Ladder(
        "radians between two lines", [1e-9, 1e-3, 1.0, 3.1, 3.2], seeded("step", angle=3.0)
    ),
    "early stopping: a label's margin from distances of any size": Ladder(
        "decades of a squared distance", [0, 100, 200, 300], seeded("power", labels=36, seed=0)
    ),
    "everywhere: threads, batches, optimisation, another engine, float32 input": Ladder(
        "vectors at once",
        [1, 10, 100, 1000],
        seeded("count", engine="one by one", n=160, kind="contacts", seed=0),
    ),
    "features: jitter, duplicates and gaps in time": Ladder(
        "shortest step, s", decades(-3, -16), seeded("shortest", seed=0), "step"
    ),
    "features: regions of hard and of random frames, to full scale": Ladder(
        "counts", [255, 4095, 16383, 65535], seeded("peak", density=0.6, seed=0), "counts"
    ),
    "kinematics: orthonormal over a million steps": Ladder(
        "radians a step", decades(0, 18, 1), seeded("reach", steps=2000)
    ),
    "kinematics: large and tiny angles": Ladder(
        "radians", decades(0, 300, 0.1), seeded("angle", seed=0)
    ),
    "kinematics: joint angles at their limits, wrapped by 2 pi": Ladder(
        "turns", [10, 10**3, 10**5, 10**7, 10**9], seeded("turns", seed=0)
    ),
    "simulator: energy of a push, 1e-3 to 1e15 N/m, 1e-9 to 1e9 kg": Ladder(
        "s a step", decades(-3, 3, 1), seeded("h", mu=0.5, steps=30)
    ),
    "limits: skins to 256 x 256 at full scale, across the seam": Ladder(
        "rows and columns", [16, 64, 128, 256, 512], seeded("side", across=True), "taxels"
    ),
    "limits: logarithms at their floor, square roots": Ladder(
        "counts in a newton", decades(3, -300, 0.1), seeded("scale", counts=51)
    ),
    "limits: values a trial, to 4096 of them": Ladder(
        "values", [120, 512, 2048, 4096, 8192], seeded("columns", seed=0), "columns"
    ),
    "limits: contacts that begin late on the clock": Ladder(
        "seconds", decades(3, 18, 1), seeded("start"), "clock"
    ),
}
"""By the key of a case."""


def search(case: Case, ladder: Ladder) -> tuple[float | None, float | None, bool]:
    """The last value that holds, the first that does not (None where there is none), and whether
    that one was refused with a sentence.

    A case that draws by a seed holds where it holds with each of `SEEDS`. Between two steps of the
    ladder the place is narrowed down to one digit.
    """
    last, first, refused = None, None, False
    for value in ladder.values:
        found = failure(case, ladder, value)
        if found:
            first, refused = value, found == REFUSED
            break
        last = value
    while last is not None and isinstance(first, float):
        middle = float(f"{math.sqrt(last) * math.sqrt(first):.0e}")
        if not min(last, first) < middle < max(last, first):
            break
        found = failure(case, ladder, middle)
        if found:
            first, refused = middle, found == REFUSED
        else:
            last = middle
    return last, first, refused


def failure(case: Case, ladder: Ladder, value: float) -> str:
    """How a case fails at a value; "" where it does not."""
    at = ladder.at(value)
    for seed in SEEDS if "seed" in at else SEEDS[:1]:
        given = {**at, "seed": seed} if "seed" in at else at
        try:
            if not case.error(**given) <= case.bound:
                return FAILED
        except EdgeError:
            return REFUSED
    return ""


def margin(case: Case) -> str:
    """The cliff of a case in words, and where recordings lie."""
    ladder = LADDERS.get(case.key)
    if ladder is None:
        return "no parameter to go further with: all of it is tried"
    with np.errstate(all="ignore"):
        last, first, refused = search(case, ladder)
    parts = [] if last is None else [f"holds to {last:.6g}"]
    if first is None:
        parts.append("no failure found")
    else:
        parts.append(f"{REFUSED if refused else FAILED} from {first:.6g}")
    there = LIE.get(ladder.lie)
    lies = f"; recordings lie at {there}" if there else ""
    return f"{ladder.what}: {', '.join(parts)}{lies}"


LIE = {
    "gap": "1e-6 (856 real grasps) and 3e-5 (cody18)",
    "offset": "3.6 and 1.4",
    "scale": "0.01 to 920 and 0.02 to 25",
    "far": "0.5 and 0.1 of the set's size",
    "counts": "3554 and 24331",
    "taxels": "13 x 13 and 16 x 24",
    "clock": "7.3 and 2.6 s, or the time since the board's start",
    "step": "0.018 and 0.010 s",
    "rows": "856 and 140",
    "columns": "120 and 120 (the paper's features)",
    "cut": "0.03 and 0.02",
}
"""Where the SDH-2 grasps and the simulated `cody18` lie, in 20 components of scaling III."""


@cache
def prices() -> Mapping[str, str]:
    """What the guards of each group of cases cost."""
    X, x = features(160), features(1, 1)
    ours, pipe = Ours(X), usual_pipeline(X, 6, 5, labels_for(X))
    whole, theirs, narrow = session(ours.data), converted(pipe, X), x.astype(np.float32)
    counts = np.zeros((16, 24), np.uint16)
    counts[4:12, 20:24] = counts[4:12, 0:4] = 65535
    tracker = ContactTracker(FOREARM, TrackSettings(debounce=1))
    contact = [c for i in range(4) for c in tracker.push(Frame(0.01 * i, counts))][-1]
    series = contact.series()
    chain = Chain.cody()
    graph, usual, region, vector, finite, pose = microseconds(
        [
            lambda: whole.run(["t_label", "t_neighbours"], {"features": x}),
            lambda: theirs.run(None, {"X": narrow}),
            lambda: largest_region(counts, 50),
            lambda: feature_vector(series, 0.03),
            lambda: np.isfinite(x).all(),
            lambda: chain.pose(np.full(chain.dof, 0.5)),
        ],
        500,
    )
    decision = (
        f"{graph:.0f} us a decision in all, against {usual:.0f} by skl2onnx (160 rows); near-"
        "duplicates closer than about 1e-6 of a deviation are one"
    )
    fit = "0 us and 0 bytes on the board: it is paid when the model is fitted"
    touch = f"within {region:.0f} us a frame for the region and its whole-number sums, 0 bytes"
    return {
        "neighbours": decision,
        "everywhere": decision,
        "scaling": fit,
        "PCA": fit,
        "simulator": "0 us and 0 bytes on the board: it is paid when trials are simulated",
        "features": f"{touch}; {vector:.0f} us a feature vector",
        "limits": touch,
        "kinematics": f"within {pose:.0f} us a pose of five joints, 0 bytes",
        FAMILY_GROUP: decision,
        "refusals": f"{finite:.1f} us a vector, and the graph's own guard within a decision",
        "early stopping": "0 us where no decision point is asked for",
    }


PRICED_AS = {
    "limits: contacts that begin late on the clock": "features",
    "limits: logarithms at their floor, square roots": "features",
    "limits: values a trial, to 4096 of them": "neighbours",
}
"""Cases whose guard is not that of their group."""


def price(case: Case) -> str:
    """What the guard of a case costs: its own figure where it has one, else its group's."""
    return case.cost() or prices().get(PRICED_AS.get(case.key, case.group), "")
