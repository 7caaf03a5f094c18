"""The settings of the decision points before the full window.

A candidate is judged by how often it errs when sure, as means over some mean times to
decision, on trials that are held out. Accuracy at a fixed window does not tell
candidates apart: which touches they are sure of differs more than how many they get
right. Entire groups are not held out here, as rules are certified for objects that are
known. The discriminants of all tasks side by side, which serve known objects best, are
no worse for others (docs/measured.md).
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from edge.arrays import Booleans, Floats, Integers
from edge.decide.info import StoppingRule
from train.choose.evaluate import fold_numbers
from train.data.folds import finest, stratified_folds
from train.data.vectors import Vectors
from train.model.agreement import factors_of
from train.model.held_out import HeldOut, held_out
from train.model.pipeline import Choice, Choices
from train.model.rules import TimeSeries
from train.model.stopping import EarlySettings

SHARES = (1 / 6, 1 / 3, 1 / 2, 2 / 3, 5 / 6)
"""Parts of the full window at which candidates may decide when sure."""
MEANS = (1 / 3, 5 / 12, 1 / 2, 7 / 12, 2 / 3)
"""Mean times to decision, as parts of the full window, at which they are judged."""
THRESHOLDS = 60
FOLDS = 5
SHRINKAGES = (0.3, 0.1, 0.03)
MOST_COMPONENTS = 100


@dataclass(frozen=True)
class SureDecisions:
    """Decisions of trials that are sure enough, for each of some thresholds.

    Attributes:
        seconds: (thresholds, n) when each trial is decided.
        wrong: (thresholds, n) whether the decision is wrong.
    """

    seconds: Floats
    wrong: Booleans

    @classmethod
    def of(
        cls,
        answered: HeldOut,
        parts: Collection[str],
        seconds: Floats,
    ) -> SureDecisions:
        """The decisions by answers to held-out trials.

        Args:
            answered: at each decision point.
            parts: the task, or the factors of a joint task, which is decided when both
                are.
            seconds: (points,) windows.
        """
        margins = [answered.margins[part] for part in parts]
        unknown = np.zeros(margins[0].shape, dtype=bool)
        time_series = TimeSeries(
            margins, [~answered.right[part] for part in parts], unknown
        )
        shares = np.linspace(0.0, 1.0, THRESHOLDS)
        decided = [
            time_series.under(StoppingRule(1.0, 0.0, threshold, len(seconds) - 1))
            for threshold in np.quantile(margins, shares).tolist()
        ]
        at, wrong = map(np.stack, zip(*decided, strict=True))
        return cls(seconds[at], wrong)

    def error(self, means_s: Floats, trials: Booleans) -> float:
        """The share of wrong decisions of some trials (n,), as the mean over some mean
        times; between two thresholds by interpolation."""
        seconds = self.seconds[:, trials].mean(axis=1)
        wrong = self.wrong[:, trials].mean(axis=1)
        return float(np.interp(means_s, seconds, wrong).mean())


def early_options(
    picks: Sequence[Choice], full: Choices, widths: Mapping[str, int]
) -> list[dict[str, Choice]]:
    """[option]{task: its settings} of candidates for early decision points: the
    features, scalings and discriminants of the best settings at the full window of each
    candidate that was not dropped there, with several shrinkages.

    None has more columns than the narrowest settings of the full window, so that there
    is room for many decision points.

    Args:
        picks: these settings.
        full: {task: its settings at the full window}. The graph has one number of
            neighbours for all decision points.
        widths: {feature: its columns}.
    """

    def columns(choice: Choice) -> int:
        return sum(widths[name] for name in choice.features)

    room = min(map(columns, full.values()))
    most = max((len(pick.targets) for pick in picks), default=0)
    options = {}
    for pick, shrinkage in product(picks, SHRINKAGES):
        side_by_side = pick.projection == "lda" and len(pick.targets) == most
        if side_by_side and columns(pick) <= room:
            kind = replace(pick, k=1, components=MOST_COMPONENTS, shrinkage=shrinkage)
            options[kind] = {
                task: replace(kind, k=at_end.k) for task, at_end in full.items()
            }
    return list(options.values())


def points_of(window_s: float) -> Floats:
    """The decision points at which the options are judged."""
    return window_s * np.array([*SHARES, 1.0])


def settle_early(
    vectors: Vectors,
    window_s: float,
    options: Sequence[Choices],
    folds: Integers,
    jobs: int,
    heading: str = "",
) -> EarlySettings:
    """The settings of the decision points before the full window: those of the option
    that errs least often when sure, as a mean over the tasks. All tasks share them, and
    so a space, which leaves room for more decision points.

    Args:
        vectors: (points, n, p) at the `points_of` the window.
        window_s: the full window.
        options: [option]{task: its settings}.
        folds: (n,) without which the settings are chosen too.
        jobs: processes.
        heading: of a progress bar on stderr; empty for none.
    """
    y = vectors.y
    fifths = stratified_folds(y[finest(y)], FOLDS)
    runs = [[[option] * len(vectors.X)] * FOLDS for option in options]
    answered = held_out(vectors, fifths, runs, jobs, heading)
    factors = factors_of(y)
    decided = {
        task: [
            SureDecisions.of(answers, factors.get(task, (task,)), points_of(window_s))
            for answers in answered
        ]
        for task in y
    }
    means_s = np.array(MEANS) * window_s
    chosen_without = []
    for fold in (-1, *fold_numbers(folds)):
        errors = np.zeros(len(options))
        for task, labels in y.items():
            tested = (labels != "") & (folds != fold)
            errors += [of.error(means_s, tested) for of in decided[task]]
        chosen_without.append(options[int(errors.argmin())])
    choices, *by_fold = chosen_without
    return EarlySettings(choices, by_fold)


def by_folds(choices: Mapping[str, Sequence[Choice]]) -> list[dict[str, Choice]]:
    """[fold]{task: its choice} from {task: [fold] its choice}."""
    folds = zip(*choices.values(), strict=True)
    return [dict(zip(choices, of_fold, strict=True)) for of_fold in folds]
