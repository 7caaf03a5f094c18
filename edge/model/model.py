"""A model.onnx on the board, and its decisions."""

from __future__ import annotations

import hashlib
import os
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from edge.errors import EdgeError, InputError
from edge.files import open_regular, parsing
from edge.model import onnx_file
from edge.model.agreement import agreed
from edge.model.info import METADATA_KEY, ModelInfo

LARGEST_BYTES = 1 << 30


class Decision(NamedTuple):
    """The answer to one task.

    >>> import edge
    >>> from edge import demo
    >>> model = edge.Model(demo.MODEL)
    >>> decision = model.decide([0.0] * model.info.width)["mobility"]
    >>> len(decision.scores), len(decision.neighbours) == model.info.tasks["mobility"].k
    (2, True)

    Attributes:
        label: what was touched. A task that is decided together with others (see
            `edge.model.agreement`) may have another label than most votes.
        confidence: the label's share of the votes, 0 to 1.
        scores: (labels,) share of the votes of each label.
        distances: (k,) of the neighbours, nearest first, in PCA space.
        neighbours: (k,) rows of the training set, nearest first.
        tie: another label had as many votes; the nearest of the tied won.
        label_distances: (labels,) mean squared distance to the nearest (up to three) training
            trials of each label, of a model with decision points or with tasks that are decided
            together: the distance of the nearest answer with this label in which they agree.
        out_of_range: the features lie so far outside those of the training trials that the model
            cut them off; see `train.projection.Grid`.
    """

    label: str
    confidence: float
    scores: NDArray[np.float64]
    distances: NDArray[np.float64]
    neighbours: NDArray[np.int64]
    tie: bool
    label_distances: NDArray[np.float64] | None = None
    out_of_range: bool = False


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
        info: its metadata.
        version: the first eight digits of the file's SHA-256.

    Raises:
        InputError: the file is missing, is not an exported model, or contradicts itself.
    """

    def __init__(self, path: str | os.PathLike[str]) -> None:
        """Load the file."""
        name = os.fspath(path)
        contents, stat, digest = _contents(name)
        text = contents.metadata.get(METADATA_KEY)
        if text is None:
            raise InputError(
                f"{name}: has no {METADATA_KEY} metadata; export it with `make export`"
            )
        self.path = name
        self.version = digest[:8]
        # First the format: an older one has other operators, but is named by its number.
        self.info = ModelInfo.from_json(text, name)
        onnx_file.check(contents, name)
        runtime = _onnxruntime()
        options = runtime.SessionOptions()
        # One thread is fastest for models of this size.
        options.intra_op_num_threads = options.inter_op_num_threads = 1
        options.log_severity_level = 3
        # Converts the constants that are stored in float32 once. More would change nothing.
        options.graph_optimization_level = runtime.GraphOptimizationLevel.ORT_ENABLE_BASIC
        options.enable_cpu_mem_arena = False
        try:
            # By its name, as a session made from bytes keeps a second copy of the file.
            self._session = runtime.InferenceSession(
                name, options, providers=["CPUExecutionProvider"]
            )
        except Exception as error:  # onnxruntime's own exceptions share no base but this
            raise InputError(
                f"{name}: ONNX Runtime refuses it ({type(error).__name__}); export it again"
            ) from None
        if not _is(name, stat):
            raise InputError(f"{name}: was changed while it was read; start again")
        self._check(name)
        self._names = [output.name for output in self._session.get_outputs()]
        # Input and outputs are arrays of ours that ONNX Runtime reads and writes in place: a
        # decision then allocates next to nothing.
        self._shape = (self.info.width,)
        self._input = np.zeros((1, *self._shape))
        self._last = len(self.decision_points_s) - 1
        self._decision_point = np.full(1, self._last, dtype=np.int64)
        outputs: dict[str, NDArray[Any]] = {
            output.name: np.zeros(
                [1, *output.shape[1:]], np.int64 if "int64" in output.type else np.float64
            )
            for output in self._session.get_outputs()
        }
        self._binding = self._session.io_binding()
        value = runtime.OrtValue.ortvalue_from_numpy
        self._binding.bind_ortvalue_input("features", value(self._input))
        if self.info.decision_points_s:
            self._binding.bind_ortvalue_input("decision_point", value(self._decision_point))
        for output, array in outputs.items():
            self._binding.bind_ortvalue_output(output, value(array))
        self._answers = [
            _Answer(
                task,
                entry.labels,
                outputs[f"{task}_label"],
                outputs[f"{task}_scores"][0],
                outputs[f"{task}_distances"][0],
                outputs[f"{task}_neighbours"][0],
                outputs[f"{task}_label_distances"][0] if self.info.has_label_distances else None,
            )
            for task, entry in self.info.tasks.items()
        ]
        self._out_of_range = outputs["out_of_range"]

    def _check(self, name: str) -> None:
        inputs = self._session.get_inputs()
        shape = inputs[0].shape if inputs else []
        if not inputs or inputs[0].name != "features" or inputs[0].type != "tensor(double)":
            raise InputError(f"{name}: has no float64 input `features`; export it again")
        optional = self._session.get_overridable_initializers()
        more = [(i.name, i.type, list(i.shape)) for i in optional]
        if len(inputs) > 1 or more != (
            [("decision_point", "tensor(int64)", [1])] if self.info.decision_points_s else []
        ):
            raise InputError(
                f"{name}: its inputs and its decision points disagree; export it again"
            )
        if len(shape) != 2 or shape[1] != self.info.width:
            raise InputError(
                f"{name}: takes {shape[1:]} features, its metadata says {self.info.width}; "
                "export it again"
            )
        outputs = {output.name: output.shape for output in self._session.get_outputs()}
        widths: dict[str, list[int]] = {"out_of_range": []}
        for task, entry in self.info.tasks.items():
            widths |= {f"{task}_label": [], f"{task}_scores": [len(entry.labels)]}
            widths |= {f"{task}_distances": [entry.k], f"{task}_neighbours": [entry.k]}
            if self.info.has_label_distances:
                widths[f"{task}_label_distances"] = [len(entry.labels)]
        for output, width in widths.items():
            if output not in outputs or outputs[output][1:] != width:
                wide = f" of width {width[0]}, as its metadata says" if width else ""
                raise InputError(f"{name}: has no output {output}{wide}; export it again")

    @property
    def named(self) -> str | None:
        """Its name and version, as events carry them; None without a name."""
        return f"{self.info.name} {self.version}" if self.info.name else None

    @property
    def decision_points_s(self) -> tuple[float, ...]:
        """Windows for which the model can decide; without calibration, only the full one."""
        return self.info.decision_points_s or (self.info.window_s,)

    def run(
        self, vectors: NDArray[np.float64], decision_point: int | None = None
    ) -> dict[str, NDArray[Any]]:
        """The graph's outputs for vectors (n, width), unguarded; for checks and benchmarks.

        Args:
            vectors: measured over the window of the decision point.
            decision_point: index in `decision_points_s`; None for the last.
        """
        given: dict[str, NDArray[Any]] = {"features": vectors}
        if self.info.decision_points_s:
            given["decision_point"] = np.array([self._place(decision_point)], dtype=np.int64)
        values = self._session.run(self._names, given)
        return dict(zip(self._names, values, strict=True))

    def _place(self, decision_point: int | None) -> int:
        if decision_point is None:
            return self._last
        if not 0 <= decision_point <= self._last:
            raise InputError(
                f"{self.path}: has the decision points 0 to {self._last}, not {decision_point}"
            )
        return decision_point

    def decide(self, vector: ArrayLike, decision_point: int | None = None) -> dict[str, Decision]:
        """Decide all tasks for one feature vector; not for several threads at once.

        Args:
            vector: (width,) measured over the window of the decision point.
            decision_point: index in `decision_points_s`; None for the last, the full window.

        Raises:
            InputError: the vector has another length, or a value that is not finite before or
                after scaling; the model has no such decision point, or its file is damaged.
        """
        x = np.asarray(vector, dtype=np.float64)
        if x.shape != self._shape:
            raise InputError(f"{self.path}: takes {self.info.width} features, not {x.shape}")
        self._input[0] = x
        self._decision_point[0] = self._place(decision_point)
        try:
            self._session.run_with_iobinding(self._binding)
        except Exception as error:  # an index past its tensor, a shape that came out otherwise
            raise self._broken(str(error)) from None
        out_of_range = self._out_of_range.item() > 0.0
        labels: dict[str, Any] = {answer.task: answer.label[0] for answer in self._answers}
        if min(labels.values()) < 0:
            raise self._refusal(x)
        distances = {
            answer.task: answer.label_distances.copy()
            for answer in self._answers
            if answer.label_distances is not None
        }
        for task, factors in self.info.products.items():
            together, nearest = agreed(task, factors, distances)
            labels |= together
            distances |= nearest
        decisions: dict[str, Decision] = {}
        for answer in self._answers:
            index, shares = int(labels[answer.task]), answer.scores.tolist()
            if index >= len(answer.labels) or not 0.0 <= shares[index] <= 1.0:
                raise self._broken(
                    f"{answer.task} is answered by label {index} of {len(answer.labels)}"
                )
            decisions[answer.task] = Decision(
                answer.labels[index],
                shares[index],
                answer.scores.copy(),
                answer.distances.copy(),
                answer.neighbours.copy(),
                shares.count(max(shares)) > 1,
                distances.get(answer.task),
                out_of_range,
            )
        return decisions

    def _broken(self, reason: str) -> InputError:
        """The error for a file that loads, but does not answer as an exported model does."""
        reason = " ".join(reason.split())[:200]
        return InputError(f"{self.path}: cannot be run ({reason}); copy or export it again")

    def _refusal(self, x: NDArray[np.float64]) -> InputError:
        """The error for a vector that the graph answers with label -1."""
        if np.isfinite(x).all():
            return InputError("the features are too large to be scaled")
        bad = int(np.argmin(np.isfinite(x)))
        ends = np.cumsum(self.info.widths)
        which = int(ends.searchsorted(bad, side="right"))
        feature = self.info.features[which]
        within = bad - int(ends[which]) + self.info.widths[which]
        return InputError(f"value {within} of {feature} is not finite")


def require_joints(model: Model, dof: int | None, where: str) -> None:
    """Refuse a source without the joint angles that the model needs.

    Args:
        model: the model.
        dof: the number of joint angles of the source, or None.
        where: names the source in the error.

    Raises:
        InputError: the source has no joint angles, or another number of them.
    """
    needed = model.info.dof
    if needed is not None and dof != needed:
        raise InputError(
            f"{where}: has {dof or 'no'} joint angles, but the model needs {needed} of each frame; "
            "record them, or export a model without joints"
        )


class _Answer(NamedTuple):
    """A task and the arrays into which ONNX Runtime writes its answer."""

    task: str
    labels: tuple[str, ...]
    label: NDArray[np.int64]
    scores: NDArray[np.float64]
    distances: NDArray[np.float64]
    neighbours: NDArray[np.int64]
    label_distances: NDArray[np.float64] | None


def _contents(name: str) -> tuple[onnx_file.Contents, os.stat_result, str]:
    """The file's contents, its identity, to see whether it changes, and its SHA-256."""
    if not os.path.lexists(name) and "\0" not in name:
        raise InputError(f"{name}: no such model; make one with `make export`")
    with open_regular(name, LARGEST_BYTES) as file:
        stat = os.fstat(file.fileno())
        with parsing(name, "a model", "; copy or export it again"):
            data = file.read(LARGEST_BYTES)
            return onnx_file.read(data, name), stat, hashlib.sha256(data).hexdigest()


def _is(name: str, stat: os.stat_result) -> bool:
    """Whether the file is still the same, unchanged."""
    try:
        now = os.stat(name)
    except OSError:
        return False
    return all(
        getattr(now, part) == getattr(stat, part)
        for part in ("st_dev", "st_ino", "st_size", "st_mtime_ns", "st_ctime_ns")
    )


def _onnxruntime() -> Any:
    """onnxruntime, imported where a model is first needed: it is most of the start-up time."""
    try:
        import onnxruntime
    except ImportError as error:
        raise EdgeError(f"onnxruntime cannot be imported ({error}); install it with pip") from None
    return onnxruntime
