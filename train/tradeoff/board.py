"""The time and memory that a decision takes on a machine, read from its board.json."""

import os
from dataclasses import dataclass

from edge.errors import InputError
from train.json_files import json_file
from train.report.section import ReportTable, Section

STAGES = ("track", "features", "decision")


@dataclass(frozen=True)
class Board:
    """A machine's figures for one model.

    Attributes:
        name: the machine.
        digest: SHA-256 over the recordings that the model was fitted on.
        stages_us: {stage: (median, 99th percentile) in microseconds}.
        memory_mb: the largest resident size.
        cold_start_ms: from the start of Python until the model is ready.
        model: SHA-256 of the model file.
    """

    name: str
    digest: str
    stages_us: dict[str, tuple[float, float]]
    memory_mb: float
    cold_start_ms: float
    model: str

    @property
    def arithmetic_s(self) -> float:
        """Seconds from the window's last frame to the decision, for the measured
        model."""
        return sum(self.stages_us[stage][0] for stage in STAGES) / 1e6


def read(path: str | os.PathLike[str]) -> Board:
    """The figures in a board file.

    Raises:
        InputError: it is missing or has other contents; the sentence names it.
    """
    name = os.fspath(path)
    remedy = f"make one with `edge-classify bench --out {name}`"
    with json_file(name, "a board file", remedy) as content:
        board = Board(
            name=f"{content['machine']['kind']} ({content['machine']['name']})",
            digest=str(content["model"]["data_digest"]),
            stages_us={
                str(name): (float(stage["median_us"]), float(stage["p99_us"]))
                for name, stage in content["stages"].items()
            },
            memory_mb=float(content["memory_mb"]),
            cold_start_ms=float(content["cold_start_ms"]),
            model=str(content["model"]["sha256"]),
        )
        if not all(0.0 < board.stages_us[s][0] < 1e9 for s in STAGES):
            raise ValueError("a stage takes no time")
    return board


def section(board: Board) -> Section:
    """The figures in the board file."""
    rows = [
        {"stage": name, "median us": median, "99th percentile us": p99}
        for name, (median, p99) in board.stages_us.items()
    ]
    return Section(
        "The board",
        [
            "`edge-classify bench` measured these times with the model "
            f"{board.model[:12]} on {board.name}. The program takes "
            f"{board.memory_mb:.0f} MB of memory, and the model is ready "
            f"{board.cold_start_ms:.0f} ms after the start of Python. The stage `track` "
            "finds the contact in a frame and measures it; `frame` and `last` are all work "
            "for a frame in a contact, and for the frame that decides. The arithmetic of a "
            "decision is the sum of the medians of track, features and decision. `make "
            "tradeoff` measures a quick model. Another board has other times: run "
            "`edge-classify bench` on it, and give the file as `BOARD=board.json`.",
        ],
        [
            ReportTable(
                "board", "Stages", rows, timed=("median us", "99th percentile us")
            )
        ],
    )


def check(board: Board, path: str, digest: str) -> None:
    """Refuse a board file that was made with a model of other recordings.

    Raises:
        InputError: the sentence names `path`.
    """
    if board.digest != digest:
        raise InputError(
            f"{path}: was made with a model of other recordings (digest "
            f"{board.digest[:12]}, these have {digest[:12]}); run `edge-classify "
            "bench` with a model of these"
        )
