"""A model.onnx on the board, and its decisions."""

import hashlib
import os
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from edge.arrays import Array, Floats, Integers
from edge.decide import onnx_file
from edge.decide.agreement import agreed
from edge.decide.engines import open_engine
from edge.decide.info import METADATA_KEY
from edge.decide.metadata_reader import from_json
from edge.errors import InputError, OutOfRange, printable
from edge.files import read_bytes

LARGEST_BYTES = 1 << 30
NONE: Any = np.zeros(0)
"""Of neighbours, where the model's scorer has none."""


class Decision(NamedTuple):
    """The answer to one task.

    >>> import edge
    >>> from edge import demo
    >>> model = edge.Model(demo.MODEL)
    >>> decision = model.decide([0.0] * model.info.width)["mobility"]
    >>> len(decision.scores), len(decision.neighbours) == model.info.tasks["mobility"].k
    (2, True)

    Attributes:
        label: the answer. A task that is decided together with others (see
            `edge.decide.agreement`) may have another label than most votes.
        confidence: the calibrated probability that the label is right, 0 to 1; None
            of a model without calibration.
        votes: the label's share of the votes, 0 to 1.
        scores: (labels,) share of the votes of each label.
        distances: (k,) of the neighbours, nearest first, in the space of the
            projection.
        neighbours: (k,) rows of the training set, nearest first. Both are empty where
            the model's scorer is another than k-NN.
        tie: another label had as many votes; the nearest of the tied won.
        label_distances: (labels,) how far the nearest training trials of each label lie
            (`train.model.pipeline.nearest_of_label` says how many), in log odds, of a
            model with decision points or with tasks that are decided together. For
            these it is the distance of the nearest answer with this label in which they
            agree.
        out_of_range: the features lie so far outside those of the training trials that
            the model cut them off; see `train.model.projection.Grid`.
        outlier_score, known_distance: the outlier score, and the distance to the known
            objects (see `edge.decide.info`), of a model with decision points.
    """

    label: str
    confidence: float | None
    votes: float
    scores: Floats
    distances: Floats
    neighbours: Integers
    tie: bool
    label_distances: Floats | None = None
    out_of_range: bool = False
    outlier_score: float = 0.0
    known_distance: float = 0.0


class Model:
    """A `model.onnx`, ready to decide.

    >>> import edge
    >>> from edge import demo
    >>> model = edge.Model(demo.MODEL)
    >>> sorted(model.info.tasks), model.info.window_s
    (['category', 'mobility', 'object'], 1.2)
    >>> model.decide([0.0] * model.info.width)["mobility"].label in ("fixed", "movable")
    True

    Attributes:
        path: of the file.
        contents: of the file.
        info: its metadata.
        version: the first eight digits of the file's SHA-256.
        engine: the program that runs the graph, one of `edge.decide.engines.ENGINES`.

    Raises:
        InputError: the file is missing, is not an exported model, or contradicts
            itself.
    """

    def __init__(self, path: str | os.PathLike[str], engine: str | None = None) -> None:
        """Load the file.

        Args:
            path: of the file.
            engine: `onnxruntime` or `numpy`; None for the first, or the second where
                the first is not installed.
        """
        name = os.fspath(path)
        self.path = name
        if not os.path.lexists(name) and "\0" not in name:
            raise InputError(f"{name}: no such model; make one with `make export`")
        data = read_bytes(name, LARGEST_BYTES)
        self.contents = onnx_file.read(data, name)
        text = self.contents.metadata.get(METADATA_KEY)
        if text is None:
            raise InputError(
                f"{name}: has no {METADATA_KEY} metadata; export it with `make export`"
            )
        self.version = hashlib.sha256(data).hexdigest()[:8]
        # First the format: an older one has other operators, but is named by its
        # number.
        self.info = from_json(text, name)
        onnx_file.check(self.contents, name)
        self._scorer = open_engine(name, self.contents, self.info, engine)
        self.engine = self._scorer.name
        self._expected = self.info.outputs
        # A graph that is not that of its metadata is refused at once.
        self.run(np.zeros((1, self.info.width)))

    @property
    def named(self) -> str | None:
        """Its name and version, as events carry them; None without a name."""
        return f"{self.info.name} {self.version}" if self.info.name else None

    def require_joints(self, dof: int | None, where: str) -> None:
        """Refuse a source without the joint angles that the model needs.

        Args:
            dof: the number of joint angles of the source, or None.
            where: names the source in the error.

        Raises:
            InputError: the source has no joint angles, or another number of them.
        """
        dof_of_model = self.info.dof
        if dof_of_model is not None and dof != dof_of_model:
            raise InputError(
                f"{where}: has {dof or 'no'} joint angles, but the model needs "
                f"{dof_of_model} of each frame; record them, or export a model without joints"
            )

    @property
    def decision_points_s(self) -> tuple[float, ...]:
        """Windows for which the model can decide; uncalibrated, only the full one."""
        return self.info.points_s

    def run(
        self,
        vectors: Floats,
        decision_point: int | None = None,
    ) -> dict[str, Array]:
        """The graph's outputs for vectors (n, width).

        Args:
            vectors: measured over the window of the decision point.
            decision_point: index in `decision_points_s`; None for the last.

        Raises:
            InputError: the model has no such decision point, or its file is damaged.
        """
        last = len(self.decision_points_s) - 1
        point = last if decision_point is None else decision_point
        if not 0 <= point <= last:
            raise InputError(
                f"{self.path}: has the decision points 0 to {last}, not {point}"
            )
        try:
            scored = self._scorer.score(vectors, point)
            outputs = {name: scored[name] for name in self._expected}
        # An index past its tensor, shapes that do not match, or a constant that lacks.
        except Exception as error:
            raise self._broken(printable(f"{type(error).__name__}: {error}")) from None
        for name, (kind, shape) in self._expected.items():
            value = outputs[name]
            if value.dtype != kind or value.shape != (len(vectors), *shape):
                raise self._broken(f"{name} is {value.dtype} {value.shape}")
        return outputs

    def decide(
        self,
        vector: ArrayLike,
        decision_point: int | None = None,
    ) -> dict[str, Decision]:
        """Decide all tasks for one feature vector.

        Args:
            vector: (width,) measured over the window of the decision point.
            decision_point: index in `decision_points_s`; None for the last, the full
                window.

        Raises:
            OutOfRange: a value of the vector is not finite, before or after scaling.
            InputError: the vector has another length, the model has no such decision
                point, or its file is damaged.
        """
        x = np.asarray(vector, dtype=np.float64)
        if x.shape != (self.info.width,):
            raise InputError(
                f"{self.path}: takes {self.info.width} features, not {x.shape}"
            )
        outputs = self.run(x[None], decision_point)
        answers = {name: value[0] for name, value in outputs.items()}
        labels: dict[str, Any] = {}
        distances: dict[str, Any] = {}
        for task in self.info.tasks:
            labels[task] = answers[f"{task}_label"]
            distances[task] = answers.get(f"{task}_label_distances")
        if min(labels.values()) < 0:
            raise self._refusal(x)
        for joint, factors in self.info.joint_tasks.items():
            # The nearest answer in which the three tasks agree.
            agreed_labels, agreed_distances = agreed(joint, factors, distances)
            labels |= agreed_labels
            distances |= agreed_distances
        point = -1 if decision_point is None else decision_point
        return {
            task: self._decision(task, point, int(label), distances[task], answers)
            for task, label in labels.items()
        }

    def _decision(
        self,
        task: str,
        point: int,
        label: int,
        distances: Any,
        answers: Mapping[str, Array],
    ) -> Decision:
        """A task's decision.

        Args:
            task: its name.
            point: index of the decision point that was asked for.
            label: index of the label in which the tasks agree.
            distances: (labels,) of the nearest answers with each label, if any.
            answers: {output: its value}.

        Raises:
            InputError: the label is none of the task's, or its votes are no share.
        """
        scores = answers[f"{task}_scores"]
        shares = scores.tolist()
        if label >= len(shares) or not 0.0 <= shares[label] <= 1.0:
            raise self._broken(f"{task} is answered by label {label} of {len(shares)}")
        outlier_score = float(answers.get("outlier_score", 0.0))
        known_distance = float(answers.get("known_distance", 0.0))
        confidence = None
        if self.info.outlier_score is not None:
            confidence = self.info.stopping[task].confidence(
                point,
                distances.tolist(),
                label,
                self.info.outlier_score.excess(point, outlier_score),
                known_distance,
            )
        return Decision(
            label=self.info.tasks[task].labels[label],
            confidence=confidence,
            votes=shares[label],
            scores=scores,
            distances=answers.get(f"{task}_distances", NONE),
            neighbours=answers.get(f"{task}_neighbours", NONE),
            tie=shares.count(max(shares)) > 1,
            label_distances=distances,
            out_of_range=bool(answers["out_of_range"] > 0.0),
            outlier_score=outlier_score,
            known_distance=known_distance,
        )

    def _broken(self, reason: str) -> InputError:
        """The error for a file that loads, but does not answer as an exported model
        does."""
        reason = " ".join(reason.split())[:200]
        return InputError(
            f"{self.path}: cannot be run ({reason}); copy or export it again"
        )

    def _refusal(self, x: Floats) -> OutOfRange:
        """The error for a vector that the graph answers with label -1."""
        finite = np.isfinite(x)
        if finite.all():
            return OutOfRange(
                "the features are too large to be scaled; check the skin's units"
            )
        place = finite.argmin()
        feature = np.repeat(self.info.features, self.info.widths)[place]
        return OutOfRange(f"value {place} of the features, of {feature}, is not finite")
