"""Describe a model: tasks, labels, accuracy, features, data, skin and arm.

Prints a model's tasks with their labels and accuracy, its features and training data,
the skin and arm that it needs, and its size. `edge-classify replay --model A --model B`
compares two on recordings.
"""

import argparse
import json
from typing import Any

from edge.app.options import add_file
from edge.app.output import Output
from edge.app.texts import wrapped
from edge.decide.info import ModelInfo
from edge.decide.metadata import to_json
from edge.decide.model import Model
from edge.decide.onnx_file import DIGITS
from edge.decide.summary import doubt
from edge.errors import counted


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the command's options."""
    add_file(parser, "model", "the model to describe", needed=True)


def run(arguments: argparse.Namespace) -> int:
    """Print the description."""
    model = Model(arguments.model)
    about = described(model)
    Output.of(arguments).event(about, description(model.info, about))
    return 0


def described(model: Model) -> dict[str, Any]:
    """A model's event: file, version, size and metadata."""
    return {
        "event": "model",
        "file": model.path,
        "version": model.version,
        "bytes": len(model.contents.data),
        "digest": model.contents.data[-DIGITS:].isalnum(),
        **json.loads(to_json(model.info)),
    }


def description(info: ModelInfo, about: dict[str, Any]) -> str:
    """The description for a person."""
    named = f"{info.name} " if info.name else ""
    size = f"{about['bytes'] / 1024:.0f} kB, format {about['format']}"
    size += "" if about["digest"] else ", no digest"
    lines = [f"{about['file']}: {named}{about['version']}, {size}", ""]
    for name, task in info.tasks.items():
        lines += wrapped(
            f"{name}: {task.accuracy:.1%} accurate (nested), "
            f"{counted(task.components, 'component')}, {counted(task.k, 'neighbour')}, "
            f"scaling {task.scaling}"
        )
        lines += wrapped(", ".join(task.labels), "  ")
    units = ", ".join(f"{name} ({unit})" for name, unit in info.units.items())
    lines += [
        "",
        f"Decides after {info.window_s:g} s, from {info.samples} samples of each of",
    ]
    lines += wrapped(units, "  ")
    if info.decision_points_s:
        points = ", ".join(f"{point:g}" for point in info.decision_points_s)
        lines.append(f"With --error, it may decide at {points} s.")
    for sentence in doubt(info.stopping):
        lines += wrapped(sentence)
    for sentence in _origin(info):
        lines += wrapped(sentence)
    return "\n".join(lines)


def _origin(info: ModelInfo) -> list[str]:
    """Sentences on the skin, the arm and the trials of a model."""
    skin = info.layout
    wraps = ", closed around" if skin.wraps else ""
    sentences = [
        f"Skin: {skin.rows} x {skin.cols} taxels{wraps}; contact above "
        f"{skin.threshold_counts} counts, onset above {skin.onset}; force in "
        f"{skin.force_unit}s."
    ]
    if info.chain is None:
        sentences.append("Arm: none; contact motion is measured on the skin.")
    else:
        names = ", ".join(info.chain.names)
        sentences.append(f"Arm: {info.chain.base} to {info.chain.tip}, joints {names}.")
    versions = ", ".join(f"{name} {version}" for name, version in info.versions.items())
    sentences.append(
        f"Compares with {info.rows} trials or prototypes, data digest "
        f"{info.data_digest[:16]}, with {versions}."
    )
    return sentences
