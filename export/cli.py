"""The command line of `python -m export`."""

from __future__ import annotations

import argparse
import logging
import os
import sys
from collections.abc import Sequence
from functools import cache, partial
from pathlib import Path
from typing import Any

import numpy as np

from edge.app.cli import dispatch
from edge.app.options import add_arm, open_arm, within
from edge.decide.classifier import suited
from edge.decide.model import Model
from edge.decide.summary import Summary, compared, decide
from edge.errors import InputError
from edge.features.vector import WINDOW_S
from edge.record.labels import read_table
from edge.record.recording import load
from edge.record.saving import find, listed
from edge.record.slips import counts_text
from edge.touch.layout import for_device
from edge.wire.skin import file as skinfile
from edge.writing import check_writable
from train.choose.options import (
    DECISION_POINTS,
    LONGEST_S,
    OF_COMMAND,
    FitOptions,
    add_options,
    count,
)
from train.data.dataset import read
from train.fitted import Fitted
from train.fitting import fit
from train.report.summary import Prices, details, summary
from train.threads import on_cluster, single_thread
from train.tradeoff import front as fronts

FIXED = ("features", "projection", "scaling", "components", "k", "window_s", "tasks")
"""Options that would make another model than the one that a point was measured with."""
MOST_LINES = 20
"""Lines that an export prints without `--verbose`."""
FILES = 4
"""Of these, at most so many name files."""


def parser() -> argparse.ArgumentParser:
    """The command line."""
    top = argparse.ArgumentParser(
        prog="edge-classify export",
        description="Fits a model for every task that the recordings' labels share, and writes "
        "OUT/model.onnx and OUT/golden.npz. Options you give are held fixed. The "
        "others are chosen by cross-validation.",
    )
    option = top.add_argument
    text = ".npz recordings or folders"
    option("--data", nargs="+", metavar="REC", help=text)
    text = "folder (default: %(default)s)"
    option("--out", type=Path, default=Path("build"), help=text)
    text = "name of the model (default: that of the folder of the recordings)"
    option("--name", help=text)
    add_options(top)
    add_arm(top, "for recordings whose joint angles name no arm (default: Cody's)")
    option(
        "--front",
        metavar="WHAT",
        help="point of `make tradeoff`, at whose window the choice is made: fast, balanced, "
        "accurate, milliseconds to decide within, or an accuracy (0 to 1) to reach",
    )
    fronts_json = Path("build/tradeoff/front.json")
    text = "file with the points (default: %(default)s)"
    option("--fronts", type=Path, metavar="front.json", default=fronts_json, help=text)
    text = "OUT/report.html too, as `make export` writes it"
    option("--report", action="store_true", help=text)
    text = "tables of candidates, features with their units, and every note"
    option("--verbose", action="store_true", help=text)
    text = "recordings that are scored and never fitted, such as those of another day"
    option("--test", nargs="+", metavar="REC", help=text)
    text = "former model.onnx, which is scored on the --test recordings too"
    option("--compare", metavar="old.onnx", help=text)
    text = "folder for the model as C99 for a microcontroller"
    option("--c", type=Path, metavar="DIR", help=text)
    text = "Dask scheduler, whose workers follow and fit"
    option("--cluster", metavar="tcp://HOST:PORT", help=text)
    text = "with --c: skin to write as C99 too; without --data it is written alone"
    option("--skin", metavar="skin.toml", help=text)
    option(
        "--c-error",
        type=within(float, 1e-6, 1.0 - 1e-6),
        metavar="RATE",
        help="with --c: share of early decisions that may be wrong (default: decisions at the "
        "full window alone)",
    )
    text = "with --c: kB that it may take; early decisions are left out first"
    option("--flash", type=count, metavar="KB", help=text)
    top.set_defaults(run=run)
    return top


def run(arguments: argparse.Namespace) -> int:
    """Fit, write and report."""
    _check_options(arguments)
    if not arguments.data:
        check_writable(arguments.c)
        _write_skin(arguments)
        return 0
    if arguments.verbose:
        for handler in logging.getLogger("train").handlers:
            handler.setLevel(logging.DEBUG)
        logging.getLogger("train").setLevel(logging.DEBUG)
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
    with single_thread(), on_cluster(arguments.cluster):
        model = _write(arguments, _fit(arguments))
        if held_out:
            print(held_out_text(model, former, held_out), file=sys.stderr)
    return 0


def _write(arguments: argparse.Namespace, fitted: Fitted) -> Model:
    """Write the model and what is asked for beside it, and print what was fitted."""
    from export.api import measure, save  # loads skl2onnx, for two seconds

    path = arguments.out / "model.onnx"
    size = save(path, fitted, arguments.name, partial(_write_c, arguments))
    prices = measure(fitted) if arguments.verbose or arguments.report else []
    _tell(fitted, prices, verbose=arguments.verbose)
    print(f"{path} ({size / 1024:.0f} kB)\n{path.with_name('golden.npz')}")
    model = Model(path)
    if arguments.report:
        from train.report.model_report import write  # loads matplotlib

        jobs = FitOptions(jobs=arguments.jobs).processes
        print(write(arguments.out, fitted, model, prices, jobs))
    return model


def _tell(fitted: Fitted, prices: Prices, *, verbose: bool) -> None:
    """Print what was fitted: the trials, accuracies, settings, doubts and notes."""
    lines = counts_text([trial.labels for trial in fitted.dataset.trials])
    if verbose:
        lines += [*details(fitted, prices), *summary(fitted)]
    else:
        lines += summary(fitted, MOST_LINES - FILES - len(lines))
    print("\n".join(lines), file=sys.stderr)


def _write_c(arguments: argparse.Namespace, model: Model) -> None:
    """Write the model in C, where that is asked for."""
    if arguments.c:
        from export.c_code import export

        _write_skin(arguments, model)
        print(export(model, arguments.c, arguments.c_error, arguments.flash))


def _write_skin(arguments: argparse.Namespace, model: Model | None = None) -> None:
    """Write the skin in C, where that is asked for."""
    if arguments.skin:
        from export import skin_code

        file = skinfile.load(arguments.skin)
        counts = skin_code.UNREADABLE
        if model is not None:
            layout = model.info.layout
            counts = for_device(layout, file.layout).threshold_counts
            if file.layout.counts_per_newton != layout.counts_per_newton:
                raise InputError(
                    f"{arguments.skin}: counts_per_newton differs from that of the "
                    "recordings, and C converts no counts; give the skin theirs"
                )
        print(skin_code.export(file, arguments.c, counts))


def _check_options(arguments: argparse.Namespace) -> None:
    """Refuse options without those that they belong to."""
    if arguments.compare and not arguments.test:
        raise InputError(
            "--compare needs --test: only recordings that neither model was fitted on "
            "tell which is better"
        )
    of_c = arguments.c_error or arguments.flash or arguments.skin
    if of_c and not arguments.c:
        raise InputError("--c-error, --flash and --skin need --c DIR")
    if not (arguments.data or arguments.skin):
        raise InputError(
            "give --data REC, or --c DIR --skin skin.toml for the skin alone"
        )


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
    options = {of_fit.name: getattr(arguments, of_fit.name) for of_fit in OF_COMMAND}
    if arguments.front is not None:
        options |= _of_front(arguments)
    points = options["decision_points_s"]
    if points is not None:
        window_s = options["window_s"] or WINDOW_S
        options["decision_points_s"] = parse_decision_points(points, window_s)
    return fit(arguments.data, **options, arm=open_arm(arguments), progress=True)


def _of_front(arguments: argparse.Namespace) -> dict[str, Any]:
    """The options of a fit at a point of `make tradeoff`.

    Raises:
        InputError: other options would make another model.
    """
    fixed = [name for name in FIXED if getattr(arguments, name) is not None]
    if fixed:
        flags = (f"--{name.removesuffix('_s')}" for name in fixed)
        raise InputError(
            f"--front makes the model that was measured; drop {', '.join(flags)}"
        )
    digest = read(arguments.data, skip_damaged=arguments.skip_damaged).digest
    front = fronts.ParetoFront.read(arguments.fronts, digest)
    point = front.pick(arguments.front)
    print(
        f"{arguments.front}: a window of {point.window_s:g} s, {front.task} "
        f"{point.accuracy:.1%} ({100 * point.low:.0f} to {100 * point.high:.0f})",
        file=sys.stderr,
    )
    return {"window_s": point.window_s, "quick": front.quick}


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
