"""Explain a model's decisions on recordings.

Prints the training trials nearest to a touch, the features that pulled it towards each of them, and
the least change of a single feature that would have given another answer. The number of a feature
says how much nearer, as a squared distance, it brings the touch to a trial than the mean of all
training trials would. `python -m train show REC --model model.onnx` draws the curves.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from typing import Any

from edge.commands.output import Output, wrapped
from edge.commands.replay import suited
from edge.errors import InputError
from edge.model.explanation import Near, Space, explain
from edge.model.info import ModelInfo
from edge.model.model import Model
from edge.model.verify import first_series
from edge.recording import Recording, find, load

MOST = 3
"""Features and changes that a line names."""
DIRECTED = 0.5
"""Part of its size that the mean of a change has if it goes one way."""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the command's options."""
    parser.add_argument("model", metavar="model.onnx", help="the model")
    parser.add_argument("recordings", nargs="+", metavar="REC", help=".npz files or folders")


def run(arguments: argparse.Namespace) -> int:
    """Print an explanation for each recording and task."""
    model, output = Model(arguments.model), Output.of(arguments)
    for path in find(arguments.recordings):
        if not output.as_json:
            output.text(str(path))
        for line in explanations(model, load(path), str(path)):
            output.event(line, text(line, model.info))
    return 0


def explanations(model: Model, recording: Recording, name: str) -> Iterator[dict[str, Any]]:
    """For each task, why the model answers a recording's first contact as it does.

    Raises:
        InputError: the recording does not suit the model, or holds no contact.
    """
    info = model.info
    contact = first_series(suited(model, recording, name), model)
    if contact is None:
        raise InputError(f"{name}: holds no contact")
    vector = info.vector(contact[1])
    for task, decision in model.decide(vector).items():
        labels = info.tasks[task].labels
        answer, rows = labels.index(decision.label), decision.neighbours.tolist()
        given = recording.labels.get(task)
        truth = labels.index(given) if given in labels else None
        form = info.features, info.widths, truth
        why = explain(Space.of(model, task), vector, rows, answer, *form)

        def trial(near: Near, labels: tuple[str, ...] = labels) -> dict[str, Any]:
            return {**near._asdict(), "label": labels[near.label], "trial": info.trial(near.row)}

        yield {
            "event": "explanation",
            "source": name,
            "task": task,
            "label": decision.label,
            "confidence": decision.confidence,
            "nearest": list(map(trial, why.voters)),
            "rival": None if why.rival is None else trial(why.rival),
            "pulls": why.pulls,
            "changes": [{**c._asdict(), "label": labels[c.label]} for c in why.changes],
        }


def text(line: dict[str, Any], info: ModelInfo) -> str:
    """An explanation for a person."""
    label, nearest, rival = line["label"], line["nearest"], line["rival"]
    votes = round(line["confidence"] * len(nearest))
    plural = "s" * (len(nearest) != 1)
    lines = [f"{line['task']}: {label}, by {votes} of {len(nearest)} vote{plural}"]
    for near in [*nearest, *([rival] if rival else [])]:
        other = ", the nearest of another label" if near is rival else ""
        lines.append(f"  {near['distance']:7.3f}  {near['trial']}, {near['label']}{other}")
        lines += wrapped(pulls_text(near["pulls"]), " " * 11)
    if rival:
        pulled = f"rather than {rival['label']}: {pulls_text(line['pulls'])}"
        lines += wrapped(pulled, "  ")
    for change in line["changes"][:MOST]:
        how = "higher" if change["mean"] > 0.0 else "lower"
        how = how if abs(change["mean"]) > DIRECTED * change["size"] else "of another course,"
        name = change["feature"]
        lines += wrapped(
            f"{change['label']}, were {name} ({info.units[name]}) {how} by {change['size']:.2g}",
            "  ",
        )
    return "\n".join(lines)


def pulls_text(pulls: dict[str, float]) -> str:
    """The strongest pulls."""
    return ", ".join(f"{name} {pull:+.2f}" for name, pull in list(pulls.items())[:MOST])
