"""The programs that score a vector by a model: ONNX Runtime, or numpy where that is
missing."""

from __future__ import annotations

import logging
from importlib import import_module
from typing import Any, Protocol

import numpy as np

from edge.arrays import Array, Floats
from edge.decide.info import ModelInfo
from edge.decide.onnx_file import Contents
from edge.errors import EdgeError, InputError
from edge.interrupt import delayed

LOG = logging.getLogger("edge.decide")
ENGINES = ("onnxruntime", "numpy")
SCORERS = {"knn": "edge.decide.knn.NearestTrials"}
"""{scorer of a model's metadata: its class in numpy}, which takes the constants and the
metadata of a file."""


class Scorer(Protocol):
    """Takes vectors and a decision point to the distances of each task's labels.

    Attributes:
        name: one of `ENGINES`.
    """

    name: str

    def score(self, vectors: Floats, point: int) -> dict[str, Array]:
        """{output: its value}, see `edge.decide.info.ModelInfo.outputs`, for vectors
        (n, width) of a decision point; exceptions of many kinds where the file is
        damaged."""


def open_engine(
    path: str,
    contents: Contents,
    info: ModelInfo,
    engine: str | None,
) -> Scorer:
    """What scores vectors by a model.

    Args:
        path: of the model's file, for errors.
        contents: of the file.
        info: its metadata.
        engine: one of `ENGINES`; None for ONNX Runtime, or numpy where it is missing.

    Raises:
        InputError: the engine or the model's scorer does not exist, or it refuses the
            file.
        EdgeError: ONNX Runtime is asked for and cannot be imported.
    """
    if engine not in (None, *ENGINES):
        raise InputError(f"there is no engine {engine!r}; give {' or '.join(ENGINES)}")
    if info.scorer not in SCORERS:
        raise InputError(
            f"{path}: is scored by {info.scorer!r}, which this edge-classify lacks"
        )
    if engine != "numpy":
        try:
            with delayed():
                import onnxruntime
        except ImportError as error:
            if engine is not None:
                raise EdgeError(
                    f"onnxruntime cannot be imported ({error}); install it with pip"
                ) from None
            LOG.warning(
                f"{path}: numpy runs the model, with the same bits, as onnxruntime "
                "cannot be imported"
            )
        else:
            return OnnxRuntime(path, contents, info, onnxruntime)
    # Most boards have ONNX Runtime.
    module, _, name = SCORERS[info.scorer].rpartition(".")
    scorer: Scorer = getattr(import_module(module), name)(contents.constants, info)
    return scorer


class OnnxRuntime:
    """ONNX Runtime with one thread."""

    name = "onnxruntime"

    def __init__(
        self, path: str, contents: Contents, info: ModelInfo, runtime: Any
    ) -> None:
        """Load the file.

        Raises:
            InputError: ONNX Runtime refuses it.
        """
        options = runtime.SessionOptions()
        # One thread is fastest for models of this size.
        options.intra_op_num_threads = 1
        options.inter_op_num_threads = 1
        options.log_severity_level = 4  # others print names out of the file
        # Converts the constants that are stored in float32 once. More would change
        # nothing.
        level = runtime.GraphOptimizationLevel.ORT_ENABLE_BASIC
        options.graph_optimization_level = level
        options.enable_cpu_mem_arena = False
        try:
            self._session = runtime.InferenceSession(
                contents.data,
                options,
                providers=["CPUExecutionProvider"],
            )
        # ONNX Runtime's own exceptions share no base but this.
        except Exception as error:
            raise InputError(
                f"{path}: ONNX Runtime refuses it ({type(error).__name__}); export it "
                "again"
            ) from None
        self._outputs = list(info.outputs)
        self._has_points = bool(info.decision_points_s)

    def score(self, vectors: Floats, point: int) -> dict[str, Array]:
        """As `Scorer.score`."""
        inputs: dict[str, Array] = {"features": vectors}
        if self._has_points:
            inputs["decision_point"] = np.array([point], dtype=np.int64)
        values = self._session.run(self._outputs, inputs)
        return dict(zip(self._outputs, values, strict=True))
