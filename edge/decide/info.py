"""What a model's file says beside its graph: its tasks, its features, and its
calibration: how sure a decision is, when it may come early, and which contacts are
unusual or of unseen objects."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from edge.arrays import Floats
from edge.config import limited
from edge.elementary import log, logistic
from edge.errors import InputError
from edge.features.names import measures
from edge.features.vector import feature_vector, widths
from edge.touch.layout import SkinLayout, for_device
from edge.touch.track import ContactTracker

if TYPE_CHECKING:
    from edge.features.kernels import KernelTable
    from edge.touch.arm import Chain
    from edge.touch.contact import FeatureSeries

METADATA_KEY = "edge-classify"
FORMAT = 12
NOT_NEGATIVE = {"low": 0.0}
RISK = {"low": 0.0, "high": 1.0, "open_low": True}
SLOPE = {"low": 1e-12, "high": 1e12}
"""Limits of fields, see `edge.config.limited`."""


@dataclass(frozen=True)
class Task:
    """A question that the model answers, and how it was fitted.

    Attributes:
        labels: the answers, in the order of the scores.
        k: neighbours that vote; 0 of another scorer than k-NN.
        components: coordinates that distances are measured in.
        scaling: "none", "columns" or "I" to "V" (paper, Eqs. 1 to 5).
        accuracy: nested accuracy of the whole choice at export, 0 to 1.
        projection: "pca" (principal components) or "lda" (discriminants).
        features: the features that it takes, in the model's order; empty for all.
        left_out: the groups left out to score the accuracy: "trial", or a label such as
            "object".
        no_contact: the answer for a recording that ends without a contact, or None.
        factors: of a task that is decided together with two others; see
            `edge.decide.agreement`.
    """

    labels: tuple[str, ...]
    k: int = field(metadata={"allowed": range(1 << 31)})
    components: int = field(metadata={"allowed": range(1 << 31)})
    scaling: str
    accuracy: float = field(metadata={"low": 0.0, "high": 1.0})
    projection: str = "pca"
    features: tuple[str, ...] = ()
    left_out: str = "trial"
    no_contact: str | None = None
    factors: Mapping[str, Sequence[int]] = field(default_factory=dict)


@dataclass(frozen=True)
class OutlierLimits:
    """When a contact is unusual: unlike all in training, whatever the object.

    The outlier score of a contact is of a space of its own
    (`train.model.outlier_score`).

    Attributes:
        typical: (decision points,) scores that half of trained contacts exceed.
        limits: (decision points,) scores that few of them exceed.
    """

    typical: tuple[float, ...] = field(metadata=NOT_NEGATIVE)
    limits: tuple[float, ...] = field(metadata=NOT_NEGATIVE)

    def excess(self, decision_point: int, score: float) -> float:
        """The logarithm of a score over the typical one; 0 below it."""
        typical = self.typical[decision_point]
        return log(score / typical) if score > typical > 0.0 else 0.0


@dataclass(frozen=True)
class KnownDistance:
    """When an object is unknown: far from the known objects by what tells objects
    apart.

    Attributes:
        limits: (decision points,) scores that few objects in training exceed.
        middles: (decision points,) scores at which an object is as likely known as not.
        slopes: (decision points,) by which the odds fall with the score's logarithm.
        worth: shares of unseen objects, see `train.model.never_met`; empty
            where none could be.
    """

    limits: tuple[float, ...] = field(metadata=NOT_NEGATIVE)
    middles: tuple[float, ...] = field(metadata={"low": 1e-9})
    slopes: tuple[float, ...] = field(metadata=NOT_NEGATIVE)
    worth: Mapping[str, float] = field(default_factory=dict)

    def known(self, decision_point: int, score: float) -> float:
        """Probability, 0 to 1, that the object is one of those in training."""
        if score <= 0.0:
            return 1.0
        log_odds = log(self.middles[decision_point] / score)
        return logistic(self.slopes[decision_point] * log_odds)


def margin(distances: Sequence[float], label: int) -> float:
    """Evidence for a label: how much farther the training trials of the nearest other
    one lie.

    Args:
        distances: (labels,) of `edge.decide.Decision.label_distances`.
        label: index of the label.

    Returns:
        The difference. It is minus infinity if the label's own trials are infinitely
        far away, and 0 if there is no other label.
    """
    distance = distances[label]
    rivals = [*distances[:label], *distances[label + 1 :]]
    nearest_rival = min(rivals, default=distance)
    return nearest_rival - distance if distance < math.inf else -math.inf


@dataclass(frozen=True)
class StoppingRule:
    """Decide at the first decision point that is sure enough, and at the last one in
    any case.

    An unusual contact waits until it no longer is, or for the full window.

    Attributes:
        error: certified: decisions are wrong at most this often.
        mean_s: mean seconds from onset to decision, on the calibration trials.
        confidence: decide from this confidence on, by the curve of all decision points.
            Above 1 no confidence is enough, so the rule waits for a fixed window.
        last: decision point at which to decide in any case.
    """

    error: float = field(metadata=RISK)
    mean_s: float
    confidence: float
    last: int


@dataclass(frozen=True)
class Stopping:
    """The calibration of one task's early decisions, which `train.model.stopping`
    makes.

    Attributes:
        slopes, intercepts, doubts: of each decision point: the probability that the
            label is right is the logistic function of slope * `margin` + intercept -
            doubt * `OutlierLimits.excess`.
        slope, intercept, doubt: the same of all decision points together, for the
            rules.
        rules: in the order of rising error. Mean times never rise along them.
        trials: number of trials that certify the rules.
        wrong: number of these trials that are decided wrongly at the full window.
        risk: probability that a rule errs more often than its certificate says.
        known_distance: of the task that names objects, and none that is unknown; else
            None.
    """

    slopes: tuple[float, ...] = field(metadata=SLOPE)
    intercepts: tuple[float, ...]
    doubts: tuple[float, ...] = field(metadata=NOT_NEGATIVE)
    slope: float = field(metadata=SLOPE)
    intercept: float
    doubt: float = field(metadata=NOT_NEGATIVE)
    rules: tuple[StoppingRule, ...]
    trials: int = field(metadata={"allowed": range(1, 1 << 31)})
    wrong: int
    risk: float = field(metadata=RISK)
    known_distance: KnownDistance | None = None

    def confidence(
        self,
        decision_point: int,
        distances: Sequence[float],
        label: int,
        excess: float,
        known_distance: float = 0.0,
    ) -> float:
        """Probability, 0 to 1, that a label is right.

        Args:
            decision_point: its index.
            distances: (labels,) of `edge.decide.Decision.label_distances`.
            label: its index.
            excess: the contact's `OutlierLimits.excess`.
            known_distance: of the contact.
        """
        log_odds = self.slopes[decision_point] * margin(distances, label)
        log_odds += self.intercepts[decision_point]
        likely = logistic(log_odds - self.doubts[decision_point] * excess)
        if self.known_distance is None:
            return likely
        return likely * self.known_distance.known(decision_point, known_distance)


@dataclass(frozen=True)
class ModelInfo:
    """A model's metadata: all that the board needs besides the weights."""

    tasks: dict[str, Task]
    layout: SkinLayout
    debounce: int
    """Frames in a row that confirm a contact."""
    window_s: float = field(metadata={"low": 0.0, "high": 3600.0, "open_low": True})
    samples: int = field(metadata={"allowed": range(2, 10_001)})
    features: tuple[str, ...]
    units: dict[str, str]
    motion_frame: str
    """`world` (with joint angles) or `skin`."""
    chain: Chain | None
    rows: int
    """Training trials, or prototypes of many, to which distances are measured."""
    data_digest: str = field(metadata={"empty": True})
    versions: dict[str, str] = field(default_factory=dict)
    decision_points_s: tuple[float, ...] = ()
    """Windows for which the model can decide, the full one last; empty without
    calibration."""
    stopping: dict[str, Stopping] = field(default_factory=dict)
    """The stopping rules of each task; empty without decision points."""
    outlier_score: OutlierLimits | None = None
    """The limits of the outlier score; None without decision points."""
    joints: int = limited(0, allowed=range(1001))
    """Number of joint angles in a frame, if a feature is made of them; else 0."""
    kernels: Mapping[str, KernelTable] = field(default_factory=dict)
    """{feature: its table} of the features that are made of kernels."""
    name: str = limited("", empty=True)
    """The model's name."""
    trials: tuple[str, ...] = ()
    """(rows,) names of the training trials, or of those next to the prototypes; empty
    where they were too many to be kept."""
    usual: Mapping[str, Sequence[float]] = field(default_factory=dict)
    """{feature: the least and the greatest mean over the full window of nearly all
    training trials}; empty without decision points."""
    still_s: tuple[float, ...] = ()
    """(dof,) seconds for which each joint stood still in nearly all training trials, at
    the longest."""
    repeats: bool = False
    """Whether frames of many training touches repeat bit for bit, as of switches or
    coarse sensors, so that this is no doubt."""
    onset: str = ""
    """What tells the onsets other than the skin, see `edge.touch.frame.ONSETS`; empty
    where the skin does."""
    scorer: str = "knn"
    """What gives the distances of labels, one of `edge.decide.engines.SCORERS`."""
    speeds: tuple[float, ...] = limited((), count=2)
    """Least and greatest speed of the joints before onset, in radians a second, for
    which the training trials speak; empty where not known."""

    @property
    def widths(self) -> tuple[int, ...]:
        """Number of values of each feature in a feature vector, in their order."""
        return widths(self.features, self.samples, self.layout, self.joints)

    def trial(self, row: int) -> str:
        """The name of a training trial, or its number where the file holds no names."""
        return self.trials[row] if self.trials else f"trial {row}"

    @property
    def width(self) -> int:
        """Length of a feature vector."""
        return sum(self.widths)

    def vector(
        self,
        series: FeatureSeries,
        window_s: float | None = None,
    ) -> Floats:
        """The model's `feature_vector` of a contact, by default at the full window."""
        window_s = window_s or self.window_s
        return feature_vector(
            series,
            window_s,
            self.samples,
            self.features,
            self.kernels,
        )

    @property
    def joint_tasks(self) -> dict[str, Mapping[str, Sequence[int]]]:
        """{task: its factors} of tasks that are decided together with two others."""
        return {name: task.factors for name, task in self.tasks.items() if task.factors}

    @property
    def points_s(self) -> tuple[float, ...]:
        """Windows for which the model can decide; uncalibrated, only the full one."""
        return self.decision_points_s or (self.window_s,)

    @property
    def has_label_distances(self) -> bool:
        """Whether the model gives the distances of the labels."""
        return bool(self.decision_points_s or self.joint_tasks)

    @property
    def outputs(self) -> dict[str, tuple[str, tuple[int, ...]]]:
        """{output of the model: its type, and its shape for one vector}."""
        scores = ["out_of_range"]
        if self.decision_points_s:
            scores += ["outlier_score", "known_distance"]
        outputs: dict[str, tuple[str, tuple[int, ...]]] = dict.fromkeys(
            scores, ("float64", ())
        )
        for task, entry in self.tasks.items():
            outputs[f"{task}_label"] = "int64", ()
            outputs[f"{task}_scores"] = "float64", (len(entry.labels),)
            if entry.k:
                outputs[f"{task}_distances"] = "float64", (entry.k,)
                outputs[f"{task}_neighbours"] = "int64", (entry.k,)
            if self.has_label_distances:
                outputs[f"{task}_label_distances"] = "float64", (len(entry.labels),)
        return outputs

    @property
    def dof(self) -> int | None:
        """Number of joint angles that a frame must have; None if the model needs
        none."""
        return (self.joints or None) if self.chain is None else self.chain.dof

    def tracker(
        self,
        layout: SkinLayout,
        *,
        max_contacts: int = 1,
        motion_on_skin: bool = False,
    ) -> ContactTracker:
        """A new tracker for a skin, with the model's rules and features.

        The options are those of `ContactTracker`.

        Raises:
            InputError: the skin is not the one that the model was made for, or several
                contacts are to have onsets from outside.
        """
        device = for_device(self.layout, layout)
        tracker = ContactTracker(
            device,
            self.debounce,
            chain=self.chain,
            horizon_s=self.window_s,
            measures=measures(device, self.features, self.joints),
            max_contacts=max_contacts,
        )
        tracker.outside = bool(self.onset)
        if tracker.outside and max_contacts > 1:
            raise InputError("the model's onsets come from outside; give --contacts 1")
        tracker.motion_on_skin = motion_on_skin
        return tracker
