"""The margin of each case, found by search, beside where recordings lie; and the
guards' prices."""

from functools import cache
from timeit import repeat

import numpy as np

from edge.errors import EdgeError
from edge.touch.features import feature_vector
from edge.touch.frame import Frame
from edge.touch.region import largest_region
from tests.hard_cases.frames import contact_of
from tests.hard_cases.models import (
    Ours,
    converted,
    features,
    labels_for,
    session,
    usual_pipeline,
)

FAILED = "fails"
REFUSED = "refused with a sentence"
SEEDS = range(5)
"""A case that draws by a seed must hold with each of these."""


def failure(case, ladder, value):
    """How a case fails at a value; "" if it holds."""
    at = {**case.hazard[0], **ladder.beside, ladder.parameter: value}
    points = [at | {"seed": seed} for seed in SEEDS] if "seed" in at else [at]
    try:
        # `not <=`, as an error may be NaN
        if not all(case.error(**at) <= case.bound for at in points):
            return FAILED
    except EdgeError:
        return REFUSED
    return ""


def margin(case):
    """The last value at which a case holds, the first at which it does not, and the
    recordings."""
    ladder = case.ladder
    if ladder is None:
        if case.bound > 0.0:
            raise ValueError(f"{case.key}: a case with a bound needs a ladder")
        return "exact"
    words = []
    with np.errstate(all="ignore"):
        for value in ladder.values:
            if ending := failure(case, ladder, value):
                words.append(f"{ending} from {value:.6g}")
                break
            words = [f"holds to {value:.6g}"]
        else:
            words.append("no failure seen")
    lies = f"; recordings lie at {ladder.recordings}" if ladder.recordings else ""
    return f"{ladder.words}: {', '.join(words)}{lies}"


@cache
def prices():
    """The cost of the guards of each group of cases."""
    X = features(160)
    x = features(1, 1)
    ours = Ours(X)
    pipe = usual_pipeline(X, 6, 5, labels_for(X))
    exported = session(ours.data)
    theirs = converted(pipe, X)
    counts = np.zeros((16, 24), np.uint16)
    counts[4:12, 20:24] = counts[4:12, 0:4] = 65535
    series = contact_of(Frame(0.01 * i, counts) for i in range(4)).series()
    calls = (
        lambda: exported.run(["t_label", "t_neighbours"], {"features": x}),
        lambda: theirs(x),
        lambda: largest_region(counts, 50),
        lambda: feature_vector(series, 0.03),
    )
    graph, usual, region, vector = (
        1e6 * min(repeat(call, number=1, repeat=2000)) for call in calls
    )
    decision = f"{graph:.0f} us a decision in all, by skl2onnx {usual:.0f}"
    fit = "none on the board: paid when the model is fitted"
    return {
        "neighbours": decision,
        "outputs": decision,
        "everywhere": decision,
        "PCA": fit,
        "simulator": "none on the board: paid when trials are simulated",
        "features": f"{region:.0f} us a frame in all, {vector:.0f} us a feature vector",
    }


def price(case):
    """The cost of a case's guard."""
    return prices()[case.guard or case.key.split(":")[0]]
