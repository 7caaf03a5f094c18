"""The margin of each case, found by search, beside where recordings lie."""

import numpy as np

from edge.errors import EdgeError

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
