"""Time each stage of a decision on this machine.

Times each stage with a touch that grows over the model's skin, and writes medians, 99th
percentiles, memory and start-up time as JSON, for `make tradeoff BOARD=board.json` on
the workstation. Each figure is that of the fastest of five rounds, as other programs
only ever make one slower.
"""

import argparse
import hashlib
import json
import math
import platform
import subprocess
import sys
import time
from collections.abc import Callable, Iterable
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np

from edge import __version__
from edge.app.options import add_file
from edge.app.output import Output
from edge.decide.classifier import Classifier
from edge.decide.model import Model
from edge.errors import InputError
from edge.record.recording import Recording
from edge.touch.frame import Frame
from edge.touch.track import first_contact
from edge.writing import check_writable, write_whole

RATE_HZ = 100.0
INSIDE = slice(1, -2)
"""The frames of the touch in which a contact is followed but neither begins nor is
decided."""
REPEATS = 5
ROUNDS = 400
"""How often each stage is timed in each repeat."""
COLD = "import edge, sys; edge.Classifier(edge.Model(sys.argv[1]))"
Timings = dict[str, float | int]


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the command's options."""
    add_file(parser, "model", "the model to time", needed=True)
    parser.add_argument(
        "--out",
        required=True,
        metavar="board.json",
        help="the file to write",
    )


def run(arguments: argparse.Namespace) -> int:
    """Measure, write the file, and print a line for each stage."""
    model = Model(arguments.model)
    output = Output.of(arguments)
    check_writable(Path(arguments.out).parent)
    board = measure(model)
    with write_whole(arguments.out) as file:
        file.write(json.dumps(board, indent=1, ensure_ascii=False).encode() + b"\n")
    for name, stage in board["stages"].items():
        output.text(
            f"{name:<10} {stage['median_us']:>9} us median {stage['p99_us']:>9} us p99"
        )
    output.event(
        {"event": "bench", "file": arguments.out}, f"written to {arguments.out}"
    )
    return 0


def measure(model: Model) -> dict[str, Any]:
    """The contents of board.json."""
    repeats = [time_stages(model, ROUNDS) for _ in range(REPEATS)]
    import resource  # only Linux and macOS have it

    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    per_megabyte = 1 << 20 if sys.platform == "darwin" else 1 << 10
    stages = {
        stage: min((times[stage] for times in repeats), key=lambda t: t["median_us"])
        for stage in repeats[0]
    }
    return {
        "machine": {
            "name": platform.node(),
            "kind": kind(),
            "edge-classify": __version__,
        },
        "model": {
            "sha256": hashlib.sha256(model.contents.data).hexdigest(),
            "data_digest": model.info.data_digest,
        },
        "stages": stages,
        "memory_mb": round(peak / per_megabyte, 1),
        "cold_start_ms": round(cold_start_ms(model.path), 1),
    }


def touch(model: Model, seconds: float) -> list[Frame]:
    """Frames of a touch on the model's skin that begins at once and grows in force and
    area."""
    layout = model.info.layout
    dof = model.info.dof
    rows, cols = np.ogrid[: layout.rows, : layout.cols]
    distance = np.hypot(rows - layout.rows // 2, cols - layout.cols // 2)
    t = np.arange(math.ceil(seconds * RATE_HZ) + 1) / RATE_HZ
    age = t[:, None, None]
    force = (layout.onset + 1) * (2.0 + 3.0 * age)
    share = np.maximum(0.0, 1.0 - distance / (2.0 + 2.0 * age))
    counts = np.minimum(force * share, 65535).astype(np.uint16)
    shear = np.stack([counts // 4] * 2, axis=3).astype(np.int16)
    recording = Recording(
        t,
        counts,
        joints=None if dof is None else np.outer(0.1 * t, np.ones(dof)),
        valid=np.ones(layout.shape, dtype=bool),
        shear=shear if layout.axes else None,
    )
    return list(recording)


def time_stages(model: Model, rounds: int) -> dict[str, Timings]:
    """Median and 99th percentile of each stage in microseconds.

    `track`: the region of a frame, the arm's pose and the measures of the features.
    `features`: from a contact's series to its vector. `decision`: ONNX Runtime and the
    answers of all tasks. `frame`: a frame within a contact, from counts to events.
    `last`: the frame at which a decision is due, likewise.
    """
    info = model.info
    layout = info.layout
    frames = touch(model, info.window_s)
    contact = first_contact(frames, info.tracker(layout))
    if contact is None:
        raise InputError(
            f"{model.path}: a contact begins above {layout.onset} counts, which no "
            "taxel reaches"
        )
    series = contact[1]
    due = next(i for i, frame in enumerate(frames) if frame.t >= info.window_s)
    vector = info.vector(series)
    calls = range(rounds)
    model.decide(vector)
    few = max(rounds // 10, 4)
    stages = {
        "track": pushed(lambda: info.tracker(layout), frames, INSIDE, rounds),
        "features": timed(lambda _: info.vector(series), calls),
        "decision": timed(lambda _: model.decide(vector), calls),
        "frame": pushed(lambda: Classifier(model), frames, INSIDE, rounds),
        "last": pushed(lambda: Classifier(model), frames, slice(due, due + 1), few),
    }
    return {name: summary(times) for name, times in stages.items()}


def pushed(
    make: Callable[[], Any],
    frames: list[Frame],
    keep: slice,
    rounds: int,
) -> list[float]:
    """Microseconds of each frame in `keep`, pushed among the others into new objects of
    `make`."""
    times: list[float] = []
    while len(times) < rounds:
        times += timed(make().push, frames)[keep]
    return times


def timed(call: Callable[[Any], object], items: Iterable[Any]) -> list[float]:
    """Microseconds of a call with each of the items."""
    times = []
    for item in items:
        began = time.perf_counter_ns()
        call(item)
        times.append((time.perf_counter_ns() - began) / 1e3)
    return times


def summary(times: list[float]) -> Timings:
    """Median, 99th percentile (nearest rank) and number of times in microseconds."""
    p99 = sorted(times)[math.ceil(0.99 * len(times)) - 1]
    median = float(np.median(times))
    return {"median_us": round(median, 2), "p99_us": round(p99, 2), "n": len(times)}


def cold_start_ms(path: str) -> float:
    """Fewest milliseconds from the start of Python to a ready classifier."""
    command = [sys.executable, "-c", COLD, path]
    starts = timed(lambda _: subprocess.run(command, check=True), range(REPEATS))
    return min(starts) / 1e3


def kind() -> str:
    """The name of the board, or else of the processor's kind."""
    with suppress(OSError):
        board = Path("/proc/device-tree/model").read_text(errors="replace")
        return board.strip("\x00 \n")
    return platform.machine()
