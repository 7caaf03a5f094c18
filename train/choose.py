"""The choice of features, scaling, projection and their numbers, by nested cross-validation."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from edge.recording import Recording
from edge.touch.feature_sets import expand
from train.agreement import products
from train.dataset import DataSet
from train.evaluate import (
    NEIGHBOURS,
    SHRINKAGES,
    AnswerTable,
    Labels,
    Result,
    SearchGrid,
    choose,
    evaluate,
    fits,
    group_folds,
    stratified_folds,
)
from train.labels import NO_CONTACT
from train.pipeline import Choice
from train.progress import bar
from train.projection import KINDS

PLAIN = (
    ("paper",),
    ("contact",),
    ("moments",),
    ("contact", "moments"),
    ("taxels",),
    ("sqrt_taxels",),
    ("kernels",),
    ("moments", "zone_kernels"),
)
"""Combinations of feature sets that are candidates for recordings without joint angles."""
WITH_JOINTS = (
    ("paper",),
    ("contact", "joints"),
    ("moments", "joints"),
    ("contact", "moments", "joints"),
    ("taxels",),
    ("sqrt_taxels",),
    ("contact", "joints", "posture"),
    ("moments", "joints", "posture"),
    ("kernels", "joints"),
    ("moments", "zone_kernels", "joints"),
)
"""Those for recordings with joint angles, whose changes show how far the thing gave way."""
DRAWN = (("paper",), ("contact",))
DRAWN_WITH_JOINTS = (*DRAWN, ("contact", "joints"))
"""Those for touches of simulated things that are drawn from kinds (`kinds_of`). Joint angles at
onset and single taxels say how the scene is built. Moments say how large and of what form a
contact is, in which simulators of soft things differ most."""
QUICK = 3
"""Combinations tried by a quick choice, from the first on."""
COMPONENTS = (1, 2, 3, 4, 5, 6, 8, 10, 14, 20)
QUICK_SHRINKAGES = (0.3, 0.03)
FEW_NEIGHBOURS = (1, 3, 5)
PAPER_SCALINGS = ("none", "I", "IV", "V")
FEWEST_GROUPS = 3
"""Objects that a class needs before entire objects can be left out."""
LEAVE_OUT = "object"
KIND = "kind"
"""Left out in place of an object where `kinds_of` names the kinds."""
TRIAL = "trial"
QUICK_FOLDS = 5
GROUP_FOLDS, FEW = 20, 300
"""Most folds of groups with at most `FEW` trials; with more trials there are ten folds."""
UNSEEN_SHRINKAGE = 0.1
"""Smallest shrinkage tried where entire groups are left out. Less shrinkage relies on differences
that are small beside the features' spread, which do not carry over to new objects."""
DRAWN_SHRINKAGES, DRAWN_COMPONENTS = (1.0, 0.3), (1, 2, 3, 4, 6, 8, 10)
"""Those tried for touches of simulated things of several kinds, and the most discriminants. Another
physics differs most in what is small beside the features' spread."""
UNSEEN_MARGIN = 0.01
"""Accuracy on left-out groups within which the cheaper candidate is taken."""
WINDOW_MARGIN = 0.02
"""Accuracy that is not worth twice the wait."""


@dataclass(frozen=True)
class Candidate:
    """Features, and how they are projected.

    Attributes:
        sets: names of feature sets and of single features.
        projection: one of `train.projection.KINDS`.
        grids: the settings tried with them.
    """

    sets: tuple[str, ...]
    projection: str
    grids: tuple[SearchGrid, ...]

    @property
    def name(self) -> str:
        """The names of its features, as `--features` takes them."""
        return " ".join(self.sets)


def candidates(
    y: Labels,
    *,
    joints: bool = False,
    drawn: bool = False,
    features: Sequence[str] | None = None,
    projection: str | None = None,
    scaling: str | None = None,
    components: int | None = None,
    k: int | None = None,
    quick: bool = False,
) -> list[Candidate]:
    """Every candidate; arguments you pass are held fixed.

    Features of several units need scaling by Method IV. Principal components of the paper's three
    features are tried with more scalings and numbers where you ask for these features only. Beside
    other candidates the best of so many settings would win by chance. Methods II and III are left
    out, as Method I and no scaling have the same neighbours. The discriminants of all tasks side by
    side tell known things best, so they are tried where no group is left out. Where `kinds_of`
    names kinds (`drawn`) only what carries over to other skins and arms is tried.
    """
    combinations_tried: Sequence[tuple[str, ...]] = WITH_JOINTS if joints else PLAIN
    if drawn:
        combinations_tried = DRAWN_WITH_JOINTS if joints else DRAWN
    if quick:
        combinations_tried = combinations_tried[:QUICK]
    if features is not None:
        combinations_tried = [tuple(features)]
    shrinkages = DRAWN_SHRINKAGES if drawn else QUICK_SHRINKAGES if quick else SHRINKAGES
    counts = DRAWN_COMPONENTS if drawn else COMPONENTS
    tried = []
    for sets in combinations_tried:
        for kind in KINDS if projection is None else (projection,):
            paper = sets == ("paper",)
            # By default discriminants are not tried for the paper's few features, and a quick
            # choice tries discriminants alone for the others.
            untried = kind == "lda" if paper else kind == "pca" and quick
            if features is None and projection is None and untried:
                continue
            thorough = features is not None and kind == "pca"
            scalings = PAPER_SCALINGS if paper and thorough else ("IV",)
            neighbours = NEIGHBOURS if thorough else FEW_NEIGHBOURS
            grid = SearchGrid(
                projection=kind,
                features=expand(sets),
                components=counts if components is None else (components,),
                shrinkages=shrinkages,
                most_directions=DRAWN_COMPONENTS[-1] if drawn else None,
                neighbours=neighbours if k is None else (k,),
            )
            pairs = products(y) if kind == "lda" else {}
            grids = [grid, *(replace(grid, targets=pairs[t], tasks=(t,)) for t in pairs)]
            together = tuple(t for t in sorted(y) if t not in pairs and (y[t] != "").all())
            if kind == "lda" and len(together) > 1 and not drawn:
                grids.append(replace(grid, targets=together))
            scaled = [
                replace(grid, scaling=method)
                for method in (scalings if scaling is None else (scaling,))
                for grid in grids
            ]
            tried.append(Candidate(tuple(sets), kind, tuple(scaled)))
    return tried


def kinds_of(recordings: Sequence[Recording]) -> NDArray[np.str_] | None:
    """(n,) kind of thing in each, where all are simulated and some kind has several objects.

    A `[[family]]` of a scene names its objects by the kind and a number. None for all other
    recordings.
    """
    if any("simulation" not in recording.meta for recording in recordings):
        return None
    objects = [recording.labels.get(LEAVE_OUT, "") for recording in recordings]
    kinds = [re.sub(r" \d+$", "", name) for name in objects]
    return np.array(kinds) if len(set(kinds)) < len(set(objects)) else None


def groupable(labels: NDArray[np.str_], groups: NDArray[np.str_]) -> bool:
    """Whether every class has enough groups that entire groups can be left out."""
    classes = set(labels.tolist())
    return len(classes) > 1 and all(
        len(set(groups[labels == label].tolist())) >= FEWEST_GROUPS for label in classes
    )


def costs(choices: Sequence[Choice], widths: Mapping[str, int]) -> NDArray[np.int64]:
    """(choices,) rank of the price of each choice's features, projection and targets, from 0.

    The price is the number of weights of the largest projection tried: these are fitted, stored on
    the board and multiplied for a decision. At an equal price the first choice ranks lower.

    Args:
        choices: the candidates' settings.
        widths: columns of each feature.
    """
    sizes: dict[tuple[object, ...], int] = {}
    kinds = [(choice.features, choice.projection, choice.targets) for choice in choices]
    for kind, choice in zip(kinds, choices, strict=True):
        weights = choice.components * sum(widths[name] for name in choice.features or widths)
        sizes[kind] = max(sizes.get(kind, 0), weights)
    ranks = {kind: rank for rank, kind in enumerate(sorted(sizes, key=lambda kind: sizes[kind]))}
    return np.array([ranks[kind] for kind in kinds], dtype=np.int64)


@dataclass(frozen=True)
class Chosen:
    """The settings that a task is fitted with, and their accuracy.

    Attributes:
        choice: the features, scaling, projection and numbers.
        accuracy: nested accuracy of the entire choice, with entire groups left out where
            `left_out` is not `trial`.
        by_trial: the same with single trials left out.
        left_out: `trial`, or the label whose groups were left out.
        candidates: nested accuracy of each candidate's own choice of numbers.
        picks: the best settings of each candidate.
        folds: (n,) of `accuracy`.
        by_fold: the choice without each fold's trials, whose answers `accuracy` counts.
    """

    choice: Choice
    accuracy: Result
    by_trial: Result
    left_out: str
    candidates: tuple[Result, ...] = ()
    picks: tuple[Choice, ...] = ()
    folds: NDArray[np.int64] = field(default_factory=lambda: np.zeros(0, np.int64), repr=False)
    by_fold: tuple[Choice, ...] = ()


class Choosing:
    """Chooses the window, and each task's settings, among candidates.

    Args:
        dataset: measured for every candidate.
        y: {task: (n,) labels}.
        tried: the candidates.
        samples: values of a feature.
        leave_out: label whose groups are left out for a task, where each of its classes has
            several of them; `TRIAL` for none. In place of an object its entire kind is left out
            where `kinds_of` names the kinds: accuracy on other objects of the same kinds says
            nothing of how a simulator's model does elsewhere.
        quick: fewer folds.
        jobs: processes.
        progress: show progress bars on stderr.
    """

    def __init__(
        self,
        dataset: DataSet,
        y: Labels,
        tried: Sequence[Candidate],
        samples: int,
        leave_out: str = LEAVE_OUT,
        quick: bool = False,
        jobs: int = 1,
        progress: bool = False,
    ) -> None:
        self._dataset, self._y, self.tried, self._samples = dataset, y, tried, samples
        self._jobs, self._progress, self._leave_out = jobs, progress, leave_out
        self._widths = dict(zip(dataset.names, dataset.widths(samples), strict=True))
        finest = max(y, key=lambda task: len(set(y[task].tolist())))
        self._folds = stratified_folds(y[finest], QUICK_FOLDS if quick else 10)
        kinds = kinds_of([t.recording for t in dataset.trials]) if leave_out == LEAVE_OUT else None
        self._grouped: set[str] = set()
        for name, groups in ((KIND, kinds), (leave_out, dataset.groups(leave_out))):
            if groups is None or name == TRIAL or self._grouped:
                continue
            self._leave_out = name
            self._grouped = {t for t in y if t != leave_out and groupable(y[t], groups)}
            count = QUICK_FOLDS if quick else GROUP_FOLDS if len(groups) <= FEW else 10
            self._group_folds = group_folds(groups, count)

    def _tables(self, window_s: float, nested: bool, what: str) -> tuple[AnswerTable, AnswerTable]:
        """The candidates' answers to left-out trials, and to left-out groups where there are any.

        Without groups, both are the answers to left-out trials.
        """
        X = self._dataset.with_kernels(window_s).features(window_s, self._samples)
        grids = [grid for candidate in self.tried for grid in candidate.grids]
        answers = partial(
            evaluate,
            X,
            features=self._dataset.names,
            widths=tuple(self._widths.values()),
            jobs=self._jobs,
            nested=nested,
        )
        total = fits(self._folds, nested)
        if self._grouped:
            total += fits(self._group_folds, nested)
        # One bar for both tables, so that the time left is that of the whole choice.
        progress = bar(total=total, desc=what, unit=" fits", disable=not self._progress)
        trials = answers(self._y, self._folds, grids, progress=progress.update)
        if not self._grouped:
            progress.close()
            return trials, trials
        unseen = [
            replace(g, shrinkages=tuple(s for s in g.shrinkages if s >= UNSEEN_SHRINKAGE))
            for g in grids
            if self._leave_out not in g.targets  # discriminants of the groups that are left out
        ]
        y = self._y
        if not any(grid.targets for grid in grids):
            y = {task: y[task] for task in y if task in self._grouped}
        with progress:
            return trials, answers(y, self._group_folds, unseen, progress=progress.update)

    def _right(self, window_s: float) -> dict[str, NDArray[np.bool_]]:
        """{task: answers of the candidate that is best in plain cross-validation}."""
        trials, groups = self._tables(window_s, False, f"{window_s:g} s")
        right: dict[str, NDArray[np.bool_]] = {}
        for task in self._y:
            table = groups if task in self._grouped else trials
            answers = table.held_out(task)[:, table.tested[task]]
            right[task] = answers[choose(answers)]
        return right

    def accuracy(self, window_s: float) -> float:
        """Mean accuracy of the tasks in plain cross-validation; missed touches count as wrong."""
        results = [
            _with_untouched(
                self._dataset.untouched_labels(task), Result(int(right.sum()), len(right))
            )
            for task, right in self._right(window_s).items()
        ]
        return sum(result.accuracy for result in results) / len(results)

    def window(self, windows: Sequence[float]) -> tuple[float, list[str]]:
        """The shortest of some windows at which every task is about as accurate as at its best.

        A task may lose a standard error, or `WINDOW_MARGIN`.

        Returns:
            The window in seconds, and sentences that say why.
        """
        if len(windows) == 1:
            return windows[0], []
        by_window = [self._right(window_s) for window_s in windows]
        right = {task: [answers[task] for answers in by_window] for task in self._y}
        order = np.arange(len(windows))
        needed = [choose(np.array(each), order, margin=WINDOW_MARGIN) for each in right.values()]
        best = windows[max(needed)]
        shares = "; ".join(
            f"{task} "
            + ", ".join(f"{a.mean():.0%} at {w:g} s" for a, w in zip(each, windows, strict=True))
            for task, each in right.items()
        )
        return best, [
            f"the window is {best:g} s, as the touches last longer than {windows[0]:g} s; in "
            f"cross-validation {shares} (--window sets it)"
        ]

    def choose(
        self, window_s: float
    ) -> tuple[dict[str, Chosen], NDArray[np.int64], list[dict[str, Choice]]]:
        """Each task's settings.

        Returns:
            {task: its settings}, the fold of each trial, and
            [fold]{task: the choice made without the fold's trials}.
        """
        trials, groups = self._tables(window_s, True, "choosing")
        without: list[dict[str, Choice]] = [{} for _ in range(int(trials.folds.max()) + 1)]
        chosen: dict[str, Chosen] = {}
        for task in self._y:
            grouped = task in self._grouped
            table, margin = (groups, UNSEEN_MARGIN) if grouped else (trials, 0.0)
            choices, prices = table.choices[task], costs(table.choices[task], self._widths)
            own = [_places_of(candidate, choices) for candidate in self.tried]
            chosen_without = without_folds(task, trials, table, prices, margin)
            for by_task, choice in zip(without, chosen_without, strict=True):
                by_task[task] = choice
            picked = [trials.choices[task].index(choice) for choice in chosen_without]
            folds = range(int(table.folds.max()) + 1)
            nested = [table.without(task, fold, prices, margin=margin) for fold in folds]
            accuracies = [
                table.answered(task, nested),
                trials.answered(task, picked),
                *(table.nested(task, prices, places) for places in own),
            ]
            untouched = self._dataset.untouched_labels(task)
            first, second, *rest = (_with_untouched(untouched, result) for result in accuracies)
            chosen[task] = Chosen(
                choices[table.chosen(task, prices, margin=margin)],
                first,
                second,
                self._leave_out if grouped else TRIAL,
                tuple(rest),
                tuple(choices[table.chosen(task, prices, places)] for places in own),
                table.folds,
                tuple(choices[place] for place in nested),
            )
        return chosen, trials.folds, without


def without_folds(
    task: str, trials: AnswerTable, table: AnswerTable, prices: NDArray[np.int64], margin: float
) -> list[Choice]:
    """[fold] the settings chosen without a fold's trials, by the rule that chooses them with all.

    By answers to left-out groups, where the settings are chosen so; the fits behind these answers
    may have seen the fold's trials, of other groups.

    Args:
        task: the task.
        trials: the candidates' answers to left-out trials.
        table: the answers that choose; `trials`, or those to left-out groups.
        prices, margin: of `choose`.
    """
    count = int(trials.folds.max()) + 1
    if table is trials:
        places = [trials.without(task, fold, prices, margin=margin) for fold in range(count)]
    else:
        answers = table.held_out(task)
        others = (answers[:, trials.folds != fold] for fold in range(count))
        places = [choose(each, prices, margin=margin) for each in others]
    return [table.choices[task][place] for place in places]


def _places_of(candidate: Candidate, choices: Sequence[Choice]) -> NDArray[np.int64]:
    """The places of a candidate's own choices."""
    names = {(grid.features, grid.projection) for grid in candidate.grids}
    return np.flatnonzero([(c.features, c.projection) in names for c in choices])


def _with_untouched(labels: Sequence[str], result: Result) -> Result:
    """Count missed touches as wrong, and recordings of no touch without a contact as right."""
    right = result.right + list(labels).count(NO_CONTACT)
    return replace(result, right=right, total=result.total + len(labels))
