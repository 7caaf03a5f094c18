"""The commands that the report prints: complete, so that a copy does what it says."""

import shlex
from dataclasses import dataclass
from pathlib import Path

DEFAULT_SCENE = "cody18"
DEFAULT_OUT = Path("build")


@dataclass(frozen=True)
class Commands:
    """Commands for the recordings of a report.

    Attributes:
        data: recordings and folders, as they were named.
        out: folder of the report.
        scene: the scene that the recordings were simulated from, or None.
        quick: whether the report's choices are quick ones.
        board: the board file; by default the one that make writes.
        task: of front.json, where it was named.
    """

    data: tuple[str, ...]
    out: Path
    scene: str | None = None
    quick: bool = False
    board: Path | None = None
    task: str | None = None

    def export(self, *options: str) -> str:
        """The command that exports a model of these recordings."""
        words = ("--quick", *options) if self.quick else options
        if not self._by_make:
            return " ".join([self._export, *words])
        line = f"make export{self._facts}"
        return f"{line} EXPORT='{' '.join(words)}'" if words else line

    def front(self, point: str) -> str:
        """The command that exports a measured model."""
        if not self._by_make:
            file = shlex.quote(str(self.out / "front.json"))
            return f"{self._export} --front {point} --fronts {file}"
        return f"make export{self._facts} FRONT={point}"

    def run(self, error: float) -> str:
        """The command that decides early with the exported model, less its skin."""
        model = shlex.quote(str(self._models / "model.onnx"))
        return f"edge-classify run --model {model} --error {error:g}"

    def tradeoff(self, options: str) -> str:
        """The command that makes this report with other options."""
        words = ["--quick"] if self.quick else []
        if self.task is not None:
            words += ["--task", self.task]
        board = self.board or self.out / "board.json"
        if not self._by_make:
            files = {
                "--board": board,
                "--out": self.out,
                "--scene": self.scene,
            }
            for option, file in files.items():
                words += [] if file is None else [option, str(file)]
            program = ["python", "-m", "train", "tradeoff", "--data", *self.data]
            return f"{shlex.join([*program, *words])} {options}"
        facts = self._facts
        if board != self.out / "board.json":
            facts += f" BOARD={board}"
        return f'make tradeoff{facts} TRADEOFF="{" ".join([*words, options])}"'

    @property
    def _models(self) -> Path:
        """The folder of exported models."""
        return self.out.parent if self.out.name == "tradeoff" else self.out

    @property
    def _export(self) -> str:
        """The program that exports, with its data and folder."""
        data = shlex.join(self.data)
        return f"python -m export --data {data} --out {shlex.quote(str(self._models))}"

    @property
    def _by_make(self) -> bool:
        """Whether make can say it: it takes no name that a shell must have quoted."""
        files = (self.out, self.scene, self.board, self.task)
        names = [*self.data, *map(str, filter(None, files))]
        plain = all(shlex.quote(name) == name for name in names)
        return self.out.name == "tradeoff" and plain

    @property
    def _facts(self) -> str:
        """What make must be told."""
        facts = ""
        folder = str(self._models / Path(self.scene).stem) if self.scene else None
        if self.data != (folder,):
            several = " ".join(self.data)
            facts += f" DATA={shlex.quote(several)}"
        elif self.scene is not None and Path(self.scene).stem != DEFAULT_SCENE:
            facts += f" SCENE={self.scene}"
        if self._models != DEFAULT_OUT:
            facts += f" OUT={self._models}"
        return facts
