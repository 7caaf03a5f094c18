"""Check that this machine computes the workstation's results.

Runs the frames and feature vectors of a golden file on this machine, and compares every result with
the stored one: integers must be equal, floats within their stated bounds. The exit status is 1 if a
result differs.
"""

from __future__ import annotations

import argparse
import logging
from typing import Any

from edge.commands.output import Output
from edge.model.model import Model
from edge.model.verify import FLOAT64, verify

LOG = logging.getLogger(__name__)


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the command's options."""
    parser.add_argument("--model", required=True, help="model.onnx")
    parser.add_argument(
        "--golden", required=True, help="golden.npz, written together with the model"
    )


def run(arguments: argparse.Namespace) -> int:
    """Print one line per quantity; 1 if one differs."""
    output = Output.of(arguments)
    checks = verify(Model(arguments.model), arguments.golden)
    width = max(len(check.name) for check in checks)
    for check in checks:
        line: dict[str, Any] = {"event": "check", "name": check.name, "rows": check.rows}
        line["passed"] = check.passed
        if check.worst < float("inf"):
            line["share_of_bound"] = round(check.worst, 6)
        if check.row is not None:
            line |= {"worst_row": check.row, "seen": check.seen, "expected": check.expected}
        verdict = "ok" if check.passed else "DIFFERS"
        output.event(line, f"{verdict:<8} {check.name:<{width}} {check.rows:>6} rows")
    failed = [check for check in checks if not check.passed]
    for check in failed:
        LOG.error(
            f"{check.name} differs, worst in row {check.row}: "
            f"{check.seen} instead of {check.expected}"
        )
    if any(check.name == FLOAT64 for check in failed):
        LOG.error(
            "vectors that only float64 tells apart have the same distances: what runs the model "
            "computes in float32; it must compute in float64, as ONNX Runtime does"
        )
    if not failed:
        output.text(f"{len(checks)} quantities agree with the golden file")
    return 1 if failed else 0
