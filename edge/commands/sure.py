"""What the commands that decide share: how sure they are to be."""

from __future__ import annotations

import argparse
import sys

from edge.errors import InputError
from edge.model.model import Model
from edge.model.prediction_set import check_rate


def add_error(parser: argparse.ArgumentParser) -> None:
    """Add the option that asks for an error rate."""
    parser.add_argument(
        "--error",
        type=float,
        metavar="RATE",
        help="decide as soon as labels are wrong at most this often (0.1: one in ten); without "
        "it, at the end of the window",
    )


def check_error(model: Model, error: float | None) -> None:
    """Refuse an error rate that cannot be held; say so where nothing can be told at it.

    Raises:
        InputError: it is outside (0, 1), or the model has no calibration.
    """
    if error is None:
        return
    check_rate(error, "--error")
    if not model.info.decision_points_s:
        raise InputError(
            f"{model.path}: has no calibration, so --error cannot be held; "
            "export it with --decision-points"
        )
    smallest = model.info.smallest_error
    if error < smallest:
        print(
            f"edge-classify: no label can be ruled out at --error {error:g}: the model was "
            f"calibrated with {sum(model.info.folds)} trials, which tell errors from "
            f"{smallest:.3f} on; decisions will come at the full window, flagged unsure",
            file=sys.stderr,
        )
