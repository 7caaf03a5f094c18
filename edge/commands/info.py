"""Describe a model: its tasks, labels, accuracy, features, skin and arm.

Prints a model's tasks with their labels and accuracy, its features and training data, and the skin
and arm that it needs; also its size, and the time of a decision on this machine.
"""

from __future__ import annotations

import argparse
import json
import os
import statistics
from typing import Any

import numpy as np

from edge.commands.bench import timed
from edge.commands.output import Output, wrapped
from edge.model.info import ModelInfo
from edge.model.model import Model

ROUNDS = 200


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the command's options."""
    parser.add_argument("model", metavar="model.onnx", help="the model")


def decision_us(model: Model) -> float:
    """Median microseconds of a decision on this machine."""
    vector = np.zeros(model.info.width)
    return statistics.median(timed(lambda _: model.decide(vector), range(ROUNDS)))


def run(arguments: argparse.Namespace) -> int:
    """Print the description."""
    model = Model(arguments.model)
    about = {
        "event": "model",
        "file": arguments.model,
        "bytes": os.path.getsize(arguments.model),
        "decision_us": round(decision_us(model), 1),
        **json.loads(model.info.to_json()),
    }
    Output.of(arguments).event(about, text(model.info, about))
    return 0


def text(info: ModelInfo, about: dict[str, Any]) -> str:
    """The description for a person."""
    skin, chain = info.layout, info.chain
    lines = [f"{about['file']}: {about['bytes'] / 1024:.0f} kB, format {about['format']}", ""]
    for name, task in info.tasks.items():
        lines += wrapped(
            f"{name}: {task.accuracy:.1%} accurate (nested), {task.components} "
            f"component{'s' * (task.components != 1)}, {task.k} "
            f"neighbour{'s' * (task.k != 1)}, scaling {task.scaling}"
        )
        lines += wrapped(", ".join(task.labels), "  ")
    units = ", ".join(f"{name} ({unit})" for name, unit in info.units.items())
    lines += ["", f"Decides after {info.window_s:g} s, from {info.samples} samples of each of"]
    lines += wrapped(units, "  ")
    if info.decision_points_s:
        points = ", ".join(f"{point:g}" for point in info.decision_points_s)
        lines.append(f"With --error, it may decide at {points} s.")
    wraps = ", closed around" if skin.wraps else ""
    versions = ", ".join(f"{name} {version}" for name, version in info.versions.items())
    for sentence in (
        f"Skin: {skin.rows} x {skin.cols} taxels{wraps}; contact above {skin.threshold_counts} "
        f"counts, onset above {skin.onset}; force in {skin.force_unit}s.",
        "Arm: none; contact motion is measured on the skin."
        if chain is None
        else f"Arm: {chain.base} to {chain.tip}, joints {', '.join(chain.names)}.",
        f"Fitted on {info.rows} trials, data digest {info.data_digest[:16]}, with {versions}.",
        f"A decision takes {about['decision_us']:g} us on this machine (median).",
    ):
        lines += wrapped(sentence)
    return "\n".join(lines)
