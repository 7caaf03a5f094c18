"""The command line of `python -m export`."""

from __future__ import annotations

import argparse
import os
import re
import sys
from collections.abc import Sequence
from functools import cache, partial
from pathlib import Path
from typing import Any

import numpy as np
from joblib import cpu_count

from edge.app.cli import dispatch
from edge.app.commands.replay import Summary, compared, decide
from edge.app.options import within
from edge.app.trial_options import add_arm, open_arm
from edge.decide.classifier import suited
from edge.decide.model import Model
from edge.errors import InputError
from edge.features.quantities import ALONE, OF_ZONES
from edge.features.vector import WINDOW_S
from edge.features.zones import ZONES
from edge.record.labels import read_table
from edge.record.recording import load
from edge.record.saving import find, listed
from edge.record.slips import counts_text
from edge.writing import check_writable
from export.api import measure, save
from train.choose.choose import SECOND_WORTH
from train.choose.decision_points import MOST_TRIALS
from train.data.dataset import read
from train.data.feature_sets import SETS
from train.data.groups import LEAVE_OUT, TRIAL
from train.fitting import Fitted, fit
from train.model.projection import KINDS
from train.model.scaling import SCALINGS
from train.model.stopping import FEWEST
from train.report.summary import summary
from train.threads import single_thread
from train.tradeoff import front as fronts

FIXED = ("features", "projection", "scaling", "components", "k", "window", "tasks")
"""Options that would make another model than the one that a point was measured with."""
FORWARDED = (
    "features projection scaling components k tasks leave_out threshold onset "
    "release dead jobs second_worth"
).split()
"""Options that `fit` takes as they are."""
DECISION_POINTS = "0.2:1.2:0.1"
LONGEST_S = 60.0
"""Longest window, and longest time that a contact may be away."""
count = within(int, 1, 1_000_000)
counts = within(int, 0, 65534)
seconds = within(float, 0.01, LONGEST_S)
"""The types of options that take a number of things, counts of a taxel, or seconds."""


def taxel(text: str) -> tuple[int, int]:
    """The row and column of a taxel.

    Raises:
        ArgumentTypeError: the text is no taxel.
    """
    place = re.fullmatch(r"([0-9]{1,4}),([0-9]{1,4})", text)
    if place is None:
        raise argparse.ArgumentTypeError(
            f"must be ROW,COL, such as 3,5, not {text[:40]!r}"
        )
    return int(place[1]), int(place[2])


OPTIONS: dict[str, dict[str, Any]] = {
    # The recordings, the model and its tasks, and the settings that can be held fixed.
    "--data": {
        "nargs": "+",
        "required": True,
        "metavar": "REC",
        "help": ".npz recordings or folders",
    },
    "--out": {
        "type": Path,
        "default": Path("build"),
        "help": "folder (default: %(default)s)",
    },
    "--name": {
        "help": "of the model (default: that of the folder of the recordings)",
    },
    "--tasks": {
        "nargs": "+",
        "metavar": "TASK",
        "help": "only these keys of the labels",
    },
    "--features": {
        "nargs": "+",
        "metavar": "NAME",
        "help": f"the features to measure, instead of a choice: sets ({', '.join(SETS)}) and "
        f"single features, ZONE_QUANTITY of {', '.join(ZONES)} and "
        f"{', '.join(OF_ZONES)}, or {', '.join(ALONE)}",
    },
    "--projection": {
        "choices": KINDS,
        "help": "fix the projection: principal components or discriminants",
    },
    "--scaling": {
        "choices": SCALINGS,
        "help": "fix the scaling (paper, Eqs. 1 to 5; or by column)",
    },
    "--components": {
        "type": count,
        "help": "fix the number of principal components",
    },
    "-k --k": {
        "type": count,
        "help": "fix the number of neighbours",
    },
    # How the others are chosen, and at which times.
    "--leave-out": {
        "default": LEAVE_OUT,
        "metavar": "KEY",
        "help": "choose and score a task with entire groups of this label held out, if each of its "
        f"classes has several groups (default: {LEAVE_OUT}); `{TRIAL}` leaves out "
        "single trials",
    },
    "--quick": {
        "action": "store_true",
        "help": "for a first look: few candidates, five folds",
    },
    "--window": {
        "type": seconds,
        "help": "seconds from onset that a decision is based on (default: "
        f"{WINDOW_S:g}, or more if touches last longer and the gain is worth the wait)",
    },
    "--second-worth": {
        "type": within(float, 0.0, 1.0),
        "default": SECOND_WORTH,
        "help": "accuracy that a second of waiting is worth where the window is chosen "
        "(default: %(default)g)",
    },
    "--decision-points": {
        "metavar": "A:B:STEP",
        "help": "calibrate decisions before the full window (edge-classify run --error), at these "
        "seconds from onset, or at a list a,b,c, or `none` (default: "
        f"{DECISION_POINTS} with {FEWEST} to {MOST_TRIALS} trials, and fewer points if "
        "the model would exceed 1.9 MB)",
    },
    "--threshold": {
        "type": counts,
        "help": "counts above which a taxel is in contact",
    },
    "--onset": {
        "type": counts,
        "help": "counts above which a contact begins",
    },
    "--release": {
        "type": seconds,
        "help": "seconds that a contact may be away and go on (default: the skin's, or longer "
        "if many touches are felt in pieces and that is much more accurate)",
    },
    "--dead": {
        "nargs": "+",
        "type": taxel,
        "default": (),
        "metavar": "ROW,COL",
        "help": "taxels that are left out, counted from 0, as they are broken",
    },
    # The point of `make tradeoff`, the arm, and the files that are written or scored.
    "--front": {
        "metavar": "WHAT",
        "help": "the choice at the window of a point of `make tradeoff`: fast, balanced, "
        "accurate, milliseconds to decide within, or an accuracy (0 to 1) to reach",
    },
    "--fronts": {
        "type": Path,
        "metavar": "front.json",
        "default": Path("build/tradeoff/front.json"),
        "help": "the file with the points (default: %(default)s)",
    },
    "--report": {
        "action": "store_true",
        "help": "also write OUT/report.html, as `make export` does",
    },
    "--test": {
        "nargs": "+",
        "metavar": "REC",
        "help": "recordings that are scored and never fitted, such as those of another day",
    },
    "--compare": {
        "metavar": "old.onnx",
        "help": "a former model.onnx, which is scored on the --test recordings too",
    },
    "--jobs": {
        "type": count,
        "default": cpu_count(),
        "help": "processes (default: all cores)",
    },
    # The model in C.
    "--c": {
        "type": Path,
        "metavar": "DIR",
        "help": "also write the model as C99 for a microcontroller, into this folder",
    },
    "--c-error": {
        "type": within(float, 1e-6, 1.0 - 1e-6),
        "metavar": "RATE",
        "help": "with --c: decide early, wrongly at most this often (default: at the full window)",
    },
    "--flash": {
        "type": count,
        "metavar": "KB",
        "help": "with --c: kB that it may take; early decisions are left out first",
    },
}
"""{spellings of an option: how argparse takes it}."""


def parser() -> argparse.ArgumentParser:
    """The command line."""
    top = argparse.ArgumentParser(
        prog="edge-classify export",
        description="Fits a model for every task that the recordings' labels share, and writes "
        "OUT/model.onnx and OUT/golden.npz. Options you give are held fixed. The "
        "others are chosen by cross-validation.",
    )
    for names, settings in OPTIONS.items():
        top.add_argument(*names.split(), **settings)
    add_arm(top, "for recordings whose joint angles name no arm (default: Cody's)")
    top.set_defaults(run=run)
    return top


def run(arguments: argparse.Namespace) -> int:
    """Fit, write and report."""
    _check_options(arguments)
    # What may fail does so before the work, which may take an hour.
    for folder in filter(None, (arguments.out, arguments.c)):
        check_writable(folder)
    former = Model(arguments.compare) if arguments.compare else None
    held_out = find(arguments.test or [])
    _check_apart(arguments.data, held_out)
    for file in held_out:
        recording = load(file)
        if former is not None:
            suited(former, recording, str(file))
    with single_thread():
        fitted = _fit(arguments)
        path = arguments.out / "model.onnx"
        size = save(path, fitted, arguments.name, partial(_write_c, arguments))
        prices = measure(fitted)
        labels = [trial.labels for trial in fitted.dataset.trials]
        print("\n".join(counts_text(labels)), end="\n\n", file=sys.stderr)
        print(summary(fitted, prices), file=sys.stderr)
        print(f"{path} ({size / 1024:.0f} kB)\n{path.with_name('golden.npz')}")
        if arguments.report:
            from train.report.model_report import write  # loads matplotlib

            print(write(arguments.out, fitted, Model(path), prices, arguments.jobs))
        if held_out:
            print(held_out_text(Model(path), former, held_out), file=sys.stderr)
    return 0


def _write_c(arguments: argparse.Namespace, model: Model) -> None:
    """Write the model in C, where that is asked for."""
    if arguments.c:
        from export.c_code import export

        print(export(model, arguments.c, arguments.c_error, arguments.flash))


def _check_options(arguments: argparse.Namespace) -> None:
    """Refuse options without those that they belong to."""
    if arguments.compare and not arguments.test:
        raise InputError(
            "--compare needs --test: only recordings that neither model was fitted on "
            "tell which is better"
        )
    if (arguments.c_error or arguments.flash) and not arguments.c:
        raise InputError("--c-error and --flash need --c DIR")


def _check_apart(data: list[str], held_out: Sequence[Path]) -> None:
    """Refuse held-out recordings that are fitted.

    Raises:
        InputError: one of them is in the data too.
    """
    # Unlike Path.resolve, this raises nothing for a link to itself.
    fitted = set(map(os.path.realpath, listed(data)))
    for file in held_out:
        if os.path.realpath(file) in fitted:
            raise InputError(
                f"{file}: is in --data and in --test; what is scored must not be fitted: "
                "move it out of the folder of --data"
            )


def _fit(arguments: argparse.Namespace) -> Fitted:
    """Fit as the options say, which may be at a point of `make tradeoff`."""
    window_s = arguments.window
    quick = arguments.quick
    if arguments.front is not None:
        fixed = [f"--{name}" for name in FIXED if getattr(arguments, name) is not None]
        if fixed:
            raise InputError(
                f"--front makes the model that was measured; drop {', '.join(fixed)}"
            )
        digest = read(arguments.data).digest
        front = fronts.ParetoFront.read(arguments.fronts, digest)
        point = front.pick(arguments.front)
        print(
            f"{arguments.front}: a window of {point.window_s:g} s, {front.task} "
            f"{point.accuracy:.1%} ({100 * point.low:.0f} to {100 * point.high:.0f})",
            file=sys.stderr,
        )
        window_s = point.window_s
        quick = front.quick
    points = arguments.decision_points
    early = None
    if points is not None:
        early = parse_decision_points(points, window_s or WINDOW_S)
    return fit(
        arguments.data,
        **{name: getattr(arguments, name) for name in FORWARDED},
        window_s=window_s,
        decision_points_s=early,
        arm=open_arm(arguments),
        quick=quick,
        progress=True,
    )


def held_out_text(
    model: Model,
    former: Model | None,
    recordings: Sequence[Path],
) -> str:
    """The accuracy on recordings of --test, also of a former model."""
    summary = _scored(model, recordings)
    paragraphs = [f"{model.path} on the recordings of --test:", summary.text()]
    if former is not None:
        before = _scored(former, recordings)
        paragraphs += [f"{former.path} on them:", before.text()]
        paragraphs.append(compared(former.path, before, model.path, summary))
    return "\n\n".join(paragraphs)


def _scored(model: Model, recordings: Sequence[Path]) -> Summary:
    """What a model decides of recordings."""
    summary = Summary(model.info.tasks)
    table_of = cache(read_table)
    for file in recordings:
        recording = load(file, table_of=table_of)
        summary.add(recording.labels, decide(model, recording, str(file)), str(file))
    return summary


def parse_decision_points(text: str, window_s: float) -> tuple[float, ...]:
    """Decision points in seconds, from `a:b:step`, `a,b,c` or `none`; the full window
    comes last.

    Raises:
        InputError: the text has another form, or a decision point is not above 0.
    """
    if text == "none":
        return ()
    try:
        points = _rising(text) if ":" in text else [*map(float, text.split(","))]
        if not all(0.0 < point <= LONGEST_S for point in points):
            raise ValueError
    except ValueError:
        raise InputError(
            f"--decision-points must be like {DECISION_POINTS} or 0.3,0.6,1.2 (seconds "
            f"above 0) or none, not {text!r}"
        ) from None
    early = {point for point in points if point < window_s}
    return (*sorted(early), window_s)


def _rising(text: str) -> list[float]:
    """The points of `a:b:step`.

    Raises:
        ValueError: the text has another form, or the points would not rise to b.
    """
    first, last, step = map(float, text.split(":"))
    if not (0.0 < first <= last <= LONGEST_S and step >= 0.01):
        raise ValueError
    points: list[float] = np.arange(first, last + 1e-9, step).round(9).tolist()
    return points


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command; returns 0 for success, 2 for bad usage or input."""
    return dispatch(parser(), argv)
