"""Why an error rate cannot be certified."""

import math

from edge.model.info import Stopping

TEST_SHARE = 0.5
"""Part of the risk that the tests on calibration trials take. The rest covers the
exported model, which errs more or less often than the folds' models do on average."""


def refusal(stopping: Stopping, error: float) -> str:
    """A sentence that says why an error rate cannot be certified, and how many
    trials could."""
    share = stopping.wrong / stopping.trials
    sentence = (
        f"the smallest error that {stopping.trials} calibration trials certify is "
        f"{stopping.rules[0].error:.3f}"
    )
    if share >= error:
        return (
            f"{sentence}, and {share:.1%} of them are decided wrongly even at the "
            "full window: more trials alone will not do"
        )
    # Chernoff: this many trials with the same share of errors are enough.
    divergence = (1.0 - share) * (math.log1p(-share) - math.log1p(-error))
    if share > 0.0:
        divergence += share * math.log(share / error)
    level = TEST_SHARE * stopping.risk
    trials = max(math.ceil(-math.log(level) / divergence), stopping.trials + 1)
    return f"{sentence}; {error:g} needs about {trials} trials"
