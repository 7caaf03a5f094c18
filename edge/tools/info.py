"""Describe a model, or compare two: tasks, labels, accuracy, features, data, skin and
arm.

Prints a model's tasks with their labels and accuracy, its features and training data,
and the skin and arm that it needs, and its size. Of two models it prints the
differences.
"""

import argparse
import json
from typing import Any

from edge.commands.output import Output, counted
from edge.commands.texts import wrapped
from edge.model.info import ModelInfo
from edge.model.metadata import to_json
from edge.model.model import Model

COARSE = ("kernels", "novelty", "stopping", "units")
"""Tables that are compared as a whole."""
NAMED = 6
"""Names that a line has at most."""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the command's options."""
    parser.add_argument("model", metavar="model.onnx", help="the model")
    parser.add_argument(
        "other",
        nargs="?",
        metavar="other.onnx",
        help="compare with this model",
    )


def run(arguments: argparse.Namespace) -> int:
    """Print the description, or the differences."""
    output = Output.of(arguments)
    model = Model(arguments.model)
    about = described(model)
    if arguments.other is None:
        output.event(about, description(model.info, about))
        return 0
    changes = differences(about, described(Model(arguments.other)))
    lines = []
    for key, pair in changes.items():
        lines += wrapped(change_text(key, *pair))
    text = "\n".join(lines) or "the models do not differ"
    output.event({"event": "comparison", "changes": changes}, text)
    return 0


def described(model: Model) -> dict[str, Any]:
    """A model's event: file, version, size and metadata."""
    return {
        "event": "model",
        "file": model.path,
        "version": model.version,
        "bytes": len(model.contents.data),
        **json.loads(to_json(model.info)),
    }


def differences(a: Any, b: Any, key: str = "") -> dict[str, list[Any]]:
    """{key, such as `tasks.object.k`: its values in a and b} where they differ; None
    for none."""
    if not (isinstance(a, dict) and isinstance(b, dict)) or key in COARSE:
        return {} if a == b else {key: [a, b]}
    changes: dict[str, list[Any]] = {}
    for name in {**a, **b}:
        changes |= differences(a.get(name), b.get(name), f"{key}.{name}".strip("."))
    return changes


def change_text(key: str, a: Any, b: Any) -> str:
    """A difference for a person: of names, which only one of the models has."""
    if key in COARSE:
        return f"{key}: differs"
    if not isinstance(a, list) and not isinstance(b, list):
        return f"{key}: {_value_text(key, a)} -> {_value_text(key, b)}"
    a = _names(key, a)
    b = _names(key, b)
    texts = []
    for sign, names, beside in (("-", a, b), ("+", b, a)):
        only = [name for name in names if name not in beside]
        if only:
            more = f" and {len(only) - NAMED} more" if len(only) > NAMED else ""
            texts.append(f"{sign} {', '.join(only[:NAMED])}{more}")
    return f"{key} ({len(a)} -> {len(b)}): {'; '.join(texts) or 'in another order'}"


def _value_text(key: str, value: Any) -> str:
    if key.endswith(".accuracy"):
        return f"{value:.1%}"
    return "a table" if isinstance(value, dict) else str(value)


def _names(key: str, values: list[Any] | None) -> list[str]:
    """The names in a list; of trials without the folders of several data sets."""
    names = list(map(str, values or []))
    if key == "trials":
        return [name.rpartition("/")[2] for name in names]
    return names


def description(info: ModelInfo, about: dict[str, Any]) -> str:
    """The description for a person."""
    named = f"{info.name} " if info.name else ""
    size = f"{about['bytes'] / 1024:.0f} kB, format {about['format']}"
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
        f"Fitted on {info.rows} trials, data digest {info.data_digest[:16]}, with "
        f"{versions}."
    )
    return sentences
