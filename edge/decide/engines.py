"""The programs that can run a model: ONNX Runtime, or numpy where that is missing."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from edge.decide.onnx_file import Contents
from edge.errors import EdgeError, InputError
from edge.files import parsing
from edge.interrupt import delayed

if TYPE_CHECKING:
    from edge.decide.graph import Graph

LOG = logging.getLogger("edge.decide")
ENGINES = ("onnxruntime", "numpy")


def open_engine(
    path: str,
    contents: Contents,
    engine: str | None,
) -> OnnxRuntime | Graph:
    """The engine of a model.

    Args:
        path: of the model's file, for errors.
        contents: of the file.
        engine: one of `ENGINES`; None for ONNX Runtime, or numpy where it is missing.

    Raises:
        InputError: the engine does not exist, or refuses the file.
        EdgeError: ONNX Runtime is asked for and cannot be imported.
    """
    if engine not in (None, *ENGINES):
        raise InputError(f"there is no engine {engine!r}; give {' or '.join(ENGINES)}")
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
            return OnnxRuntime(path, contents, onnxruntime)
    from edge.decide.graph import Graph  # most boards have ONNX Runtime

    with parsing(path, "an ONNX model", "; copy or export it again"):
        return Graph(contents)


class OnnxRuntime:
    """ONNX Runtime with one thread; `edge.decide.graph.Graph` has the same attributes.

    Attributes:
        name: one of `ENGINES`.
        run: gives the outputs of a list of names for {input: its value}; it raises
            exceptions of many kinds where the graph cannot be computed.
        inputs: {input: its type and shape}; a size that is not known is no number.
        outputs: {output: its type and shape}.
    """

    name = "onnxruntime"

    def __init__(self, path: str, contents: Contents, runtime: Any) -> None:
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
            session = runtime.InferenceSession(
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
        self.run = session.run
        self.inputs = _declared(
            [*session.get_inputs(), *session.get_overridable_initializers()]
        )
        self.outputs = _declared(session.get_outputs())


def _declared(values: Sequence[Any]) -> dict[str, tuple[str, list[Any]]]:
    return {value.name: (value.type, value.shape) for value in values}
