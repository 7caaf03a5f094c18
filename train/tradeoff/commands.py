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
    """

    data: tuple[str, ...]
    out: Path
    scene: str | None = None
    quick: bool = False

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

    def tradeoff(self, options: str) -> str:
        """The command that makes this report with other options."""
        words = f"--quick {options}" if self.quick else options
        if not self._by_make:
            data = shlex.join(self.data)
            out = shlex.quote(str(self.out))
            return f"python -m train tradeoff --data {data} --out {out} {words}"
        return f'make tradeoff{self._facts} TRADEOFF="{words}"'

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
        names = [*self.data, str(self.out), self.scene or "-"]
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
