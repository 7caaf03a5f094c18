"""Explain a model's decisions on recordings.

Prints the training trials nearest to a touch, and in which features it is more like the
nearest trial with the answer, or more like the nearest one with another label, the
strongest first. `python -m train show REC --model model.onnx` draws the curves.
"""

import argparse
from collections.abc import Iterator, Sequence
from typing import Any

from edge.commands.output import Output, counted
from edge.commands.texts import wrapped
from edge.model.info import ModelInfo
from edge.model.model import Model
from edge.recording import Recording, load
from edge.saving import find
from edge.tools.explanation import Near, Space, explain
from edge.tools.replay import contact_of

MOST = 3
"""Features that a line names."""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the command's options."""
    parser.add_argument("model", metavar="model.onnx", help="the model")
    parser.add_argument(
        "recordings",
        nargs="+",
        metavar="REC",
        help=".npz files or folders",
    )


def run(arguments: argparse.Namespace) -> int:
    """Print an explanation for each recording and task."""
    model = Model(arguments.model)
    output = Output.of(arguments)
    for path in find(arguments.recordings):
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
    """For each task, why the model answers a recording's first contact as it does.

    Raises:
        InputError: the recording does not suit the model, or holds no contact.
    """
    info = model.info
    vector = info.vector(contact_of(model, recording, name))
    for task, decision in model.decide(vector).items():
        labels = info.tasks[task].labels
        answer = labels.index(decision.label)
        rows = decision.neighbours.tolist()
        true_label = recording.labels.get(task)
        truth = labels.index(true_label) if true_label in labels else None
        space = Space.of(model, task)
        why = explain(space, vector, rows, answer, info.features, info.widths, truth)
        yield {
            "event": "explanation",
            "source": name,
            "task": task,
            "label": decision.label,
            "confidence": decision.confidence,
            "votes": decision.votes,
            "nearest": [_trial(near, info, labels) for near in why.voters],
            "rival": why.rival and _trial(why.rival, info, labels),
            "pulls": why.pulls,
        }


def _trial(near: Near, info: ModelInfo, labels: Sequence[str]) -> dict[str, Any]:
    """A training trial near a touch, with its name and its label."""
    names = {"label": labels[near.label], "trial": info.trial(near.row)}
    return {**near._asdict(), **names}


def text(line: dict[str, Any]) -> str:
    """An explanation for a person."""
    label = line["label"]
    nearest = line["nearest"]
    rival = line["rival"]
    votes = round(line["votes"] * len(nearest))
    lines = [f"{line['task']}: {label}, by {votes} of {counted(len(nearest), 'vote')}"]
    lines.append("  The nearest training trials, each with its distance:")
    lines += map(trial_text, nearest)
    if rival:
        lines += ["  The nearest one with another label:", trial_text(rival)]
        strongest = list(line["pulls"].items())[:MOST]
        for nearer, sign in ((label, 1.0), (rival["label"], -1.0)):
            names = [name for name, pull in strongest if sign * pull > 0.0]
            if names:
                sentence = f"It is more like {nearer} in {', '.join(names)}."
                lines += wrapped(sentence, "  ")
    return "\n".join(lines)


def trial_text(trial: dict[str, Any]) -> str:
    """A training trial: distance, name and label."""
    return f"  {trial['distance']:7.3f}  {trial['trial']}: {trial['label']}"
