"""Deciding as soon as it is sure: a calibrated confidence at each decision point.

A model decides at several decision points, each with a window, a projection and
training rows of its own. Those before the last may have settings of their own too
(`EarlySettings`): early the arm tells what the skin tells later. Confidence, rules and
the outlier score limits are made from trials that the deciding model did not see: the
trials are divided into folds, and each fold is decided by a model that was fitted, and
whose settings were chosen, without it.

**Confidence.** The margin says how much nearer the training trials of the named label
lie than those of any other (`edge.decide.info.margin`). Logistic regression turns it
into the probability that the label is right (Platt, Probabilistic outputs for support
vector machines, 1999), at the full window by a curve of its own, before it by one of
all points together. A label's distance is that of its nearest twentieth
(`train.model.pipeline.label_distances`). So it is the same for the folds' models, which
have fewer trials, as for the exported one.

Where entire groups, such as objects, are held out for a task, its curve of the full
window is made as if a share `SHARE` of the answers were to groups that the deciding
model has not met.
Their errors come by groups: one that is wrong is wrong about nearly all of its trials.

**Rules** are certified by `train.model.rules`. They compare the confidences of all
decision points with one threshold, by the curve of all points together.

A touch that is unusual at a decision point waits, for the full window if it stays so:
rules are tested with this wait. An error is a wrong label. The task that names objects,
which has most labels but for kinds such as category, names none that is unknown. So an
`unknown` for a trained object is an error of it too.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import astuple, dataclass, replace

import numpy as np

from edge.arrays import Booleans, Floats, Integers
from edge.decide.info import OutlierLimits, Stopping, StoppingRule
from edge.elementary import log
from edge.errors import InputError
from edge.features.vector import FEATURES
from train.data.folds import finest, stratified_folds
from train.data.vectors import Strings, Vectors
from train.model.curves import Curve, Evidence, cross_fitted
from train.model.held_out import (
    AtPoints,
    HeldOut,
    answers,
    at_points,
    held_out,
    slopes_at_points,
)
from train.model.limits import UNUSUAL_RATE, beyond, limits_of
from train.model.never_met import (
    SHARE,
    known_distance_of,
    known_of,
    object_folds,
    worth_of,
)
from train.model.outlier_score import (
    OutlierSpace,
    Scores,
    held_out_scores,
    least_deviations,
)
from train.model.pipeline import Choices, Fits
from train.model.prototypes import divided
from train.model.rules import RISK, TimeSeries, agreeing, candidates, certify
from train.threads import single_thread

FEWEST = 20
"""Trials that calibration needs."""


@dataclass(frozen=True)
class EarlySettings:
    """Settings of the decision points before the full window.

    Attributes:
        choices: {task: Choice}; a task without one has the settings of the full window.
        by_fold: [fold]{task: the choice made without the fold's trials}.
    """

    choices: Choices
    by_fold: Sequence[Choices]


def excess_of(outlier_score: OutlierLimits, scores: Floats) -> Floats:
    """(points, n) by how much the logarithm of the outlier score (points, n) is above
    that of half of the trials; 0 below."""
    typical = np.array(outlier_score.typical)[:, None]
    ratios = np.maximum(np.nan_to_num(scores), typical) / typical
    return np.asarray(log(ratios))


@dataclass(frozen=True)
class Certified:
    """A task's certified rules.

    Attributes:
        rules: in the order of rising error.
        trials: number of trials that certify them.
        wrong: number of these that are wrong at the full window.
    """

    rules: Sequence[StoppingRule]
    trials: int
    wrong: int


@dataclass(eq=False)
class SequentialClassifier:
    """All tasks of a model at several windows, with rules that say when to stop
    waiting.

    Args:
        choices: {task: Choice} of the full window.
        decision_points_s: windows in seconds, increasing; the last is the full window.
        features: names of the feature types, in the order of the vectors; features that
            `choices` do not take are there for the choices of the folds.
        jobs: processes.
        widths: columns of each feature type; equal where None.
        early: settings of early decision points; those of the full window where None.
        drawn: whether a scene drew the trained objects, so that the model is for other
            arms than the scene's.
        prototypes: most of a set of labels; 0 where each trial is a row of the model.
        heading: of progress bars on stderr; empty for none.

    Attributes:
        decision_points_: a fitted `ContactClassifier` for each decision point.
        columns_: the columns of the vectors that these take, rising.
        right_: {task: (decision points, n) whether the labels named without a trial are
            right}.
        unusual_, unknown_: (decision points, n) the doubts about trials without them.
        stopping_: {task: Stopping}.
        space_: in which the outlier score and the distance to known objects are scored.
        outlier_score_, known_distance_: their limits.
    """

    choices: Choices
    decision_points_s: Sequence[float]
    features: Sequence[str] = FEATURES
    jobs: int = 1
    widths: Sequence[int] | None = None
    early: EarlySettings | None = None
    drawn: bool = False
    prototypes: int = 0
    heading: str = ""

    def fit(
        self,
        X: Floats,
        y: Mapping[str, Strings],
        folds: Integers,
        fold_choices: Sequence[Choices],
        grouped: Collection[str] = (),
    ) -> SequentialClassifier:
        """Fit and calibrate.

        Args:
            X: (decision points, n, p).
            y: {task: (n,) labels}; empty where a trial has none.
            folds: (n,) from 0, or -1 for trials that calibrate nothing.
            fold_choices: [fold]{task: Choice}, chosen without the fold's trials.
            grouped: the tasks for which entire groups are held out.

        Raises:
            InputError: there are too few trials, or X is not finite.
        """
        n = int((folds >= 0).sum())
        if n < FEWEST:
            raise InputError(
                f"calibration needs at least {FEWEST} trials, not {n}; record more, or "
                "export without decision points"
            )
        vectors = Vectors(X, y, self.features, self.widths)
        self._folds = folds
        self._tested = {task: (folds >= 0) & (y[task] != "") for task in self.choices}
        inputs = self._fit_points(vectors)
        self._fit_outlier_score(inputs, folds)
        early = [{}] * len(fold_choices) if self.early is None else self.early.by_fold
        of_folds = list(map(self._at_points, fold_choices, early))
        of_all = [self.choices_at] * len(of_folds)
        chosen_without, chosen_by_all = held_out(
            vectors,
            folds,
            [of_folds, of_all],
            self.jobs,
            self.heading,
            [self.prototypes] * 2,
        )
        self.right_ = chosen_without.right
        never_met = self._never_met(inputs)
        unseen = {task: never_met[task] for task in grouped if task in never_met}
        self.stopping_ = self._with_curves(
            self._certified(chosen_without), chosen_by_all, unseen
        )
        self.known_distance_ = replace(self._bare, worth=self._worth(never_met))
        named = replace(self.stopping_[self._name], known_distance=self.known_distance_)
        self.stopping_[self._name] = named
        return self

    @property
    def choices_at(self) -> AtPoints:
        """[decision point]{task: Choice}."""
        early = {} if self.early is None else self.early.choices
        return self._at_points(self.choices, early)

    def _at_points(self, full: Choices, early: Choices) -> AtPoints:
        """[decision point]{task: Choice} of choices for the full window and for early
        points."""
        before = len(self.decision_points_s) - 1
        return [*[{**full, **early}] * before, full]

    def _fit_points(self, vectors: Vectors) -> Vectors:
        """Fit the classifier of each decision point; the vectors that these take."""
        choices = [choice for at in self.choices_at for choice in at.values()]
        features = set().union(*(c.features or self.features for c in choices))
        self.columns_ = vectors.columns_of(features)
        self.n_features_in_ = len(self.columns_)
        vectors = vectors.of(features)
        fits: list[Fits] = [{} for _ in vectors.X]
        if self.prototypes:
            of_trials = divided(
                vectors, slice(None), self.choices_at, self.prototypes, fits
            )
            vectors = replace(vectors, prototypes=of_trials)
        slopes = slopes_at_points([self.choices_at], vectors, self.jobs)
        with single_thread():
            self.decision_points_ = at_points(self.choices_at, vectors, fits, slopes)
        return vectors

    def _fit_outlier_score(self, vectors: Vectors, folds: Integers) -> None:
        """Fit the space of doubt, and set its limits by held-out trials."""
        kinds = {*self.joint_tasks_}.union(*self.joint_tasks_.values())
        names = self.choices.keys() - kinds or self.choices.keys()
        self._name = finest({task: vectors.y[task] for task in names})
        labels = vectors.y[self._name]
        least = least_deviations(vectors, self.drawn)
        with single_thread():
            self.space_ = OutlierSpace.of(vectors.X, labels, vectors.columns, least)
        outlier_folds = np.where(folds >= 0, stratified_folds(labels), -1)

        def scores_without(folds: Integers) -> Scores:
            return held_out_scores(
                vectors.X, labels, folds, vectors.columns, self.jobs, least
            )

        scores = scores_without(outlier_folds)
        # A copy of another trial says nothing of how far new ones lie.
        counted = scores.outlier_score.min(axis=0) > 0.0
        if counted.sum() < FEWEST:
            counted = folds >= 0
        tested = scores.part(counted)
        self.outlier_score_ = OutlierLimits(
            *limits_of(tested.outlier_score, UNUSUAL_RATE)
        )
        self._excess = excess_of(self.outlier_score_, scores.outlier_score)
        self._objects = object_folds(np.where(folds >= 0, labels, ""))
        left_out = None
        if self._objects is not None:
            self._left_out = scores_without(self._objects)
            left_out = self._left_out.part(self._objects >= 0).known_distance
        self._bare = known_distance_of(tested.known_distance, left_out)
        self._known = known_of(self._bare, scores.known_distance)
        self.unusual_ = beyond(self.outlier_score_.limits, scores.outlier_score)
        self.unknown_ = beyond(self._bare.limits, scores.known_distance)

    def _worth(self, never_met: Mapping[str, Evidence]) -> dict[str, float]:
        """What the doubt about names is worth, by answers to objects that were held
        out; empty where none could be."""
        if self._objects is None:
            return {}
        answers = never_met[self._name]
        stopping = self.stopping_[self._name]
        curve = Curve(stopping.slopes[-1], stopping.intercepts[-1], stopping.doubts[-1])
        tested = self._tested[self._name] & (self._objects >= 0)
        known_distance = self._left_out.known_distance[:, tested]
        confidence = curve.probabilities(answers.margins, answers.excess)
        confidence = confidence * known_of(self._bare, known_distance)[-1]
        unknown = beyond(self._bare.limits, known_distance)[-1]
        known = self.unknown_[-1, self._folds >= 0]
        return worth_of(known, unknown, confidence)

    def _never_met(self, vectors: Vectors) -> dict[str, Evidence]:
        """{task: answers at the full window to trials of objects that the deciding
        model has not met}; none where none could be held out. The vectors are those
        that the model takes."""
        objects = self._objects
        if objects is None:
            return {}
        at_end = replace(vectors, X=vectors.X[-1:])
        runs = [[self.choices]] * (int(objects.max()) + 1)
        (answered,) = held_out(
            at_end, objects, [runs], self.jobs, self.heading, [self.prototypes]
        )
        excess = excess_of(self.outlier_score_, self._left_out.outlier_score)[-1]
        evidence = {}
        for task, tested in self._tested.items():
            answered_to = tested & (objects >= 0)
            margins = answered.margins[task][-1, answered_to]
            right = answered.right[task][-1, answered_to]
            always = np.ones(len(margins))
            weights = SHARE / (1.0 - SHARE) * always
            evidence[task] = Evidence(
                margins, excess[answered_to], right, right, always, weights
            )
        return evidence

    def _certified(self, answered: HeldOut) -> dict[str, Certified]:
        """{task: its rules}, by answers whose settings were chosen without the fold."""
        scores = {}
        for task, right in answered.right.items():
            scores[task] = cross_fitted(
                answered.margins[task],
                self._excess,
                right,
                self._folds,
                self._tested[task],
            )
        doubts = self.unusual_, self.unknown_
        series = self._series(scores, answered.right, doubts, self._tested)
        seconds = np.array(self.decision_points_s)
        rules = {
            task: certify(time_series, seconds) for task, time_series in series.items()
        }
        for task, factors in self.joint_tasks_.items():
            rules |= agreeing(task, factors, rules, series, seconds)
        full, _ = candidates(len(seconds))
        certified = {}
        for task, of_task in rules.items():
            _, wrong = series[task].under(full)
            certified[task] = Certified(of_task, len(wrong), int(wrong.sum()))
        return certified

    def _with_curves(
        self,
        certified: Mapping[str, Certified],
        answered: HeldOut,
        never_met: Mapping[str, Evidence],
    ) -> dict[str, Stopping]:
        """{task: its rules, with curves by answers of the exported settings}.

        Margins are on the scale of the settings, so slopes come from those that the
        exported model uses, in fits without the trials. As the trials had a part in the
        choice of these, the curves' means come from choices without them (`right_`).
        """
        stopping = {}
        for task, tests in self._tested.items():
            right = answered.right[task][:, tests]
            ones = np.ones(right.shape)
            evidence = Evidence(
                answered.margins[task][:, tests],
                self._excess[:, tests],
                right,
                self.right_[task][:, tests],
                known=ones,
                weights=ones,
            )
            together = evidence.curve()
            early = together
            if task == self._name:
                evidence = replace(evidence, known=self._known[:, tests])
                early = evidence.curve()
            at_end = evidence.at(-1)
            if task in never_met:
                at_end = at_end.beside(never_met[task])
            before = [early] * (len(self.decision_points_s) - 1)
            curves = [*before, at_end.curve()]
            slopes, intercepts, doubts = zip(*map(astuple, curves), strict=True)
            stopping[task] = Stopping(
                slopes=slopes,
                intercepts=intercepts,
                doubts=doubts,
                slope=together.slope,
                intercept=together.intercept,
                doubt=together.doubt,
                rules=tuple(certified[task].rules),
                trials=certified[task].trials,
                wrong=certified[task].wrong,
                risk=RISK,
            )
        return stopping

    @property
    def joint_tasks_(self) -> dict[str, dict[str, tuple[int, ...]]]:
        """{task: its factors} of the tasks decided together."""
        return self.decision_points_[-1].joint_tasks_

    def judged(
        self,
        X: Floats,
        y: Mapping[str, Strings],
    ) -> tuple[dict[str, Booleans], dict[str, Floats], dict[str, TimeSeries]]:
        """Hits and confidences (points, m) and time series of each task, for trials
        that are new.

        Args:
            X: (points, m, p).
            y: {task: (m,) labels}.
        """
        with single_thread():
            answered = answers(self.decision_points_, X)
        scores = self.space_.scores(X)
        excess = excess_of(self.outlier_score_, scores.outlier_score)
        right = {}
        confidence = {}
        together = {}
        for task, (labels, margins) in answered.items():
            stopping = self.stopping_[task]
            right[task] = labels == y[task]
            pooled = Curve(stopping.slope, stopping.intercept, stopping.doubt)
            together[task] = pooled.probabilities(margins, excess)
            curves = map(Curve, stopping.slopes, stopping.intercepts, stopping.doubts)
            by_point = map(Curve.probabilities, curves, margins, excess)
            confidence[task] = np.stack(list(by_point))
        confidence[self._name] *= known_of(self.known_distance_, scores.known_distance)
        unusual = beyond(self.outlier_score_.limits, scores.outlier_score)
        doubts = unusual, beyond(self.known_distance_.limits, scores.known_distance)
        tested = {task: y[task] != "" for task in right}
        return right, confidence, self._series(together, right, doubts, tested)

    def _series(
        self,
        scores: Mapping[str, Floats],
        right: Mapping[str, Booleans],
        doubts: tuple[Booleans, Booleans],
        tested: Mapping[str, Booleans],
    ) -> dict[str, TimeSeries]:
        """{task: its time series}, from each task's own answers and confidences for
        rules (points, n), and whether contacts are unusual and unknown (points, n).

        The trials `tested` (n,) count; for a joint task, those that count for its
        factors too.
        """
        series = {}
        unusual, unknown = doubts
        for task in self.choices:
            deciding = tuple(self.joint_tasks_.get(task, (task,)))
            decided = np.all([tested[t] for t in (task, *deciding)], axis=0)
            sure = [scores[part][:, decided] for part in deciding]
            wrong = [~right[part][:, decided] for part in deciding]
            withheld = unknown[:, decided] if task == self._name else None
            series[task] = TimeSeries(sure, wrong, unusual[:, decided], withheld)
        return series
