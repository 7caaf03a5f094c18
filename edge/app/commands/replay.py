"""Decide on recordings, frame by frame.

Decides on recordings as `edge-classify run` decides live. Files that cannot be used are
named on stderr and skipped; the exit status is then 2.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterable
from functools import cache
from pathlib import Path

from edge.app.options import add_engine, add_error, apart, check_error
from edge.app.output import LOG, Output
from edge.decide.model import Model
from edge.decide.summary import Summary, compared, decide
from edge.errors import InputError
from edge.record.labels import read_table
from edge.record.recording import load
from edge.record.saving import find


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the command's options."""
    parser.add_argument(
        "--model",
        action="append",
        default=[],
        metavar="model.onnx",
        help="the model; may stand without --model; repeat it to compare several on the "
        "same recordings",
    )
    parser.add_argument(
        "--summary",
        action="store_true",
        help="each task's accuracy and confusion matrix, for labelled recordings",
    )
    add_engine(parser)
    add_error(parser)
    parser.add_argument(
        "recordings",
        nargs="+",
        metavar="REC",
        help=".npz files or folders, and models",
    )


def run(arguments: argparse.Namespace) -> int:
    """Print the events; 2 if a file could not be used."""
    files, recordings = apart(arguments.recordings, *arguments.model)
    models = [Model(path, arguments.engine) for path in files]
    if not models or not recordings:
        raise InputError("give a model.onnx, and recordings to replay")
    output = Output.of(arguments)
    paths = find(recordings)
    summaries = []
    failed = 0
    for model in models:
        check_error(model, arguments.error)
        if len(models) > 1 and not output.as_json:
            output.text(f"{model.path}:")
        summary = Summary(model.info.tasks)
        failed += _replay(model, paths, arguments.error, output, summary)
        summaries.append(summary)
        if arguments.summary:
            output.text(summary.text())
    for model, summary in zip(models[1:], summaries[1:], strict=True):
        output.text(compared(models[0].path, summaries[0], model.path, summary))
    return 2 if failed else 0


def _replay(
    model: Model,
    paths: Iterable[Path],
    error: float | None,
    output: Output,
    summary: Summary,
) -> int:
    """Print a model's events of recordings; the number of files it could not use."""
    failed = 0
    table_of = cache(read_table)
    for path in paths:
        try:
            recording = load(path, table_of=table_of)
            events = decide(model, recording, str(path), error)
        except InputError as problem:
            failed += 1
            LOG.error("%s", problem)
            continue
        labels = recording.labels
        if not output.as_json:
            named = [f"{task}: {label}" for task, label in sorted(labels.items())]
            output.text(", ".join([str(path), *named]))
        for event in events:
            line = {"source": str(path), **event}
            if event["event"] == "decision" and event["task"] in labels:
                line["expected"] = labels[event["task"]]
            output.event(line)
        summary.add(labels, events, str(path))
    return failed
