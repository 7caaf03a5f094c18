"""The commands that the report prints: complete, so that a copy does what it says."""

import os
import shlex
import sys
from dataclasses import dataclass
from pathlib import Path

PROGRAM = shlex.quote(os.path.relpath(Path(sys.executable).with_name("edge-classify")))
"""Runs in a shell that knows nothing of the environment."""


@dataclass(frozen=True)
class Commands:
    """Commands for the recordings of a report.

    Attributes:
        data: recordings and folders, as they were named.
        touch: one of the recordings.
        out: folder of the report.
        quick: whether the report's choices are quick ones.
    """

    data: tuple[str, ...]
    touch: Path
    out: Path
    quick: bool = False

    def export(self, *options: str) -> str:
        """The command that exports a model of these recordings."""
        quick = ("--quick",) if self.quick else ()
        return " ".join([self._export, *quick, *options])

    def front(self, point: str) -> str:
        """The command that exports a measured model."""
        file = shlex.quote(str(self.out / "front.json"))
        return f"{self._export} --front {point} --fronts {file}"

    def run(self, error: float) -> str:
        """The command that decides early with the exported model, on a recording in
        place of the skin."""
        model = shlex.quote(str(self._models / "model.onnx"))
        touch = shlex.quote(str(self.touch))
        return f"{PROGRAM} run --model {model} --error {error:g} --fake {touch}"

    @property
    def _models(self) -> Path:
        """The folder of exported models."""
        return self.out.parent if self.out.name == "tradeoff" else self.out

    @property
    def _export(self) -> str:
        """The program that exports, with its data and folder."""
        data = shlex.join(self.data)
        return f"{PROGRAM} export --data {data} --out {shlex.quote(str(self._models))}"
