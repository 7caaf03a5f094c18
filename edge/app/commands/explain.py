"""Explain a model's decisions on recordings.

Prints the training trials nearest to a touch, which voted, each with its label and its
distance. `edge-classify show REC --model model.onnx` draws the curves.
"""

import argparse
from collections.abc import Iterator
from typing import Any

from edge.app.options import add_file, apart
from edge.app.output import Output
from edge.decide.model import Model
from edge.decide.summary import contact_of
from edge.errors import InputError, counted
from edge.record.recording import Recording, load
from edge.record.saving import find


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the command's options."""
    add_file(parser, "model", "the model to explain")
    help = ".npz files or folders"
    parser.add_argument("recordings", nargs="+", metavar="REC", help=help)


def run(arguments: argparse.Namespace) -> int:
    """Print an explanation for each recording and task."""
    models, recordings = apart(arguments.recordings, arguments.model)
    if len(models) != 1 or not recordings:
        raise InputError("give one model.onnx, and the recordings to explain")
    model = Model(models[0])
    output = Output.of(arguments)
    for path in find(recordings):
        if not output.as_json:
            output.text(str(path))
        for line in explanations(model, load(path), str(path)):
            output.event(line, text(line))
    return 0


def explanations(
    model: Model,
    recording: Recording,
    name: str,
) -> Iterator[dict[str, Any]]:
    """For each task, the trials that answer a recording's first contact.

    Raises:
        InputError: the recording does not suit the model, or holds no contact.
    """
    info = model.info
    vector = info.vector(contact_of(model, recording, name))
    for task, decision in model.decide(vector).items():
        labels = model.contents.constants[f"labels of {task}"].tolist()
        nearest = [
            {
                "trial": info.trial(row),
                "label": info.tasks[task].labels[labels[row]],
                "distance": distance,
            }
            for row, distance in zip(
                decision.neighbours.tolist(), decision.distances.tolist(), strict=True
            )
        ]
        yield {
            "event": "explanation",
            "source": name,
            "task": task,
            "label": decision.label,
            "confidence": decision.confidence,
            "votes": decision.votes,
            "nearest": nearest,
        }


def text(line: dict[str, Any]) -> str:
    """An explanation for a person."""
    nearest = line["nearest"]
    count = counted(len(nearest), "vote")
    votes = round(line["votes"] * len(nearest))
    lines = [f"{line['task']}: {line['label']}, by {votes} of {count}"]
    lines.append("  The nearest training trials, each with its distance:")
    for trial in nearest:
        lines.append(f"  {trial['distance']:7.3f}  {trial['trial']}: {trial['label']}")
    return "\n".join(lines)
