"""`PYTHON -m tests.hard_cases.float32`: does `verify` notice an engine of float32?

It lets OpenVINO, which computes the graph in float32, answer the hard sets' golden
files. Whoever runs a model by another engine must be told so by `edge-classify verify`.
"""

import argparse
import sys
from pathlib import Path

import numpy as np
import openvino

from edge.model import model as model_module
from edge.model.engines import open_engine
from edge.model.graph import Graph
from edge.model.model import Model
from edge.model.verify import verify
from tests.hard_cases.elsewhere import sets


class OpenVino(Graph):
    """OpenVINO on the processor, told to compute in float32."""

    name = "openvino"

    def __init__(self, path, contents):
        super().__init__(contents)
        core = openvino.Core()
        core.set_property("CPU", {"INFERENCE_PRECISION_HINT": "f32"})
        self._compiled = core.compile_model(path, "CPU")

    def run(self, names, inputs):
        """The named outputs, in the types that the graph declares."""
        ports = [port.any_name for port in self._compiled.inputs]
        results = self._compiled({name: inputs[name] for name in ports})
        kinds = {name: kind for name, (kind, _) in self.outputs.items()}
        whole = {name: "int64" in kind for name, kind in kinds.items()}
        return [
            np.asarray(results[name], np.int64 if whole[name] else np.float64)
            for name in names
        ]


def engine_of(path, contents, engine):
    """OpenVINO, where no engine is asked for."""
    return (
        OpenVino(path, contents)
        if engine is None
        else open_engine(path, contents, engine)
    )


def main(argv=None):
    """Say how many hard sets `verify` refuses; 1 if it accepts a set with wrong labels."""
    parser = argparse.ArgumentParser(prog="float32", description=__doc__)
    parser.add_argument("--golden", type=Path, default=Path("build/hard-cases/golden"))
    arguments = parser.parse_args(argv)
    model_module.open_engine = engine_of
    refused = []
    mislabelled = []
    folders = sets(arguments.golden)
    for folder in folders:
        checks = verify(Model(folder / "model.onnx"), folder / "golden.npz")
        failed = [check.name for check in checks if not check.passed]
        if failed:
            refused.append(folder.name)
        if any(name.endswith("_label") for name in failed):
            mislabelled.append(folder.name)
    print(
        f"OpenVINO {openvino.__version__.partition('-')[0]} in float32: verify refuses "
        f"{len(refused)} of {len(folders)} hard sets; it gives other labels in "
        f"{len(mislabelled)} ({', '.join(mislabelled) or 'none'})"
    )
    return int(not refused or not {*mislabelled} <= {*refused})


if __name__ == "__main__":
    sys.exit(main())
