"""Teach a model labelled trials, on the board.

Adds the trials to the nearest neighbours of the model, in the projection that it has.
Writes the new model into a folder, and a golden file if the model has a golden.npz
beside it. A label that the model does not know is added with --new-labels, and is left
out without it. A taught model carries no certificate: it decides at the end of its
window, and `run --error` refuses it. The next `make export` with the same recordings
fits everything anew.
"""

import argparse
from pathlib import Path

import numpy as np

from edge.commands.install import FORMER, keep_former
from edge.commands.output import LOG, Output, counted
from edge.model.model import Model
from edge.model.verify import renew
from edge.recording import load
from edge.saving import find
from edge.tools.replay import contact_of
from edge.tools.teaching import joined, spelled_like, taught, unknown_labels
from edge.writing import remove_leftovers, write_whole


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the command's options."""
    parser.add_argument("--model", required=True, help="model.onnx")
    parser.add_argument(
        "recordings",
        nargs="+",
        metavar="REC",
        help=".npz files or folders",
    )
    parser.add_argument(
        "--out",
        type=Path,
        default=Path("taught"),
        help="a folder (default: %(default)s)",
    )
    text = "add the labels that the model does not know, such as a new object"
    parser.add_argument("--new-labels", action="store_true", help=text)


def run(arguments: argparse.Namespace) -> int:
    """Write the taught model and its golden file."""
    model = Model(arguments.model)
    output = Output.of(arguments)
    remove_leftovers(arguments.out)
    names = []
    vectors = []
    labels = []
    for path in find(arguments.recordings):
        recording = load(path)
        series = contact_of(model, recording, str(path))
        names.append(str(path))
        labels.append(joined(recording.labels))
        vectors.append([model.info.vector(series, s) for s in model.decision_points_s])
    golden = Path(arguments.model).with_name("golden.npz")
    at_points = np.array(vectors).swapaxes(0, 1)
    data = taught(model, names, at_points, labels, new_labels=arguments.new_labels)
    target = arguments.out / "model.onnx"
    if keep_former(target, data):
        LOG.warning(
            f"{target}: the model that was there is kept, with the end {FORMER}"
        )
        keep_former(target.with_name("golden.npz"), b"")
    with write_whole(target) as file:
        file.write(data)
    after = Model(target)
    if golden.exists():
        renew(golden, target.with_name("golden.npz"), after, at_points)
    else:
        LOG.warning(f"{golden}: no such file, so none is written for the taught model")
    unknown = unknown_labels(model.info, labels)
    for task, entry in after.info.tasks.items():
        count = sum(trial_labels.get(task) in entry.labels for trial_labels in labels)
        new = unknown[task] if arguments.new_labels else {}
        line = {"event": "taught", "task": task, "trials": count, "new_labels": new}
        text = f"{task}: {count} of {len(names)} trials taught"
        output.event({**line, "file": str(target)}, text)
        for label, trials in unknown[task].items():
            of_label = f"{counted(trials, 'trial')} of the new label {label!r}"
            if not new:
                of_label = f"left out {of_label}; --new-labels adds it"
            question = spelled_like(label, model.info.tasks[task].labels)
            LOG.warning(f"{task}: {of_label}{question}")
    LOG.info(
        f"{target}: its accuracy is not measured, and no error rate is certified any "
        "more"
    )
    return 0
