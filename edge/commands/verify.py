"""Check that this machine computes the workstation's results.

Runs the frames and feature vectors of a golden file on this machine, and compares every
result with the stored one: integers must be equal, floats within their stated bounds.
The exit status is 1 if a result differs.
"""

import argparse
from typing import Any

from edge.commands.options import add_engine
from edge.commands.output import LOG, Output
from edge.model.model import Model
from edge.model.verify import verify


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the command's options."""
    parser.add_argument("--model", required=True, help="model.onnx")
    parser.add_argument(
        "--golden", required=True, help="golden.npz, written together with the model"
    )
    add_engine(parser)


def run(arguments: argparse.Namespace) -> int:
    """Print one line per result; 1 if one differs."""
    output = Output.of(arguments)
    checks = verify(Model(arguments.model, arguments.engine), arguments.golden)
    width = max(len(check.name) for check in checks)
    for check in checks:
        line: dict[str, Any] = {
            "event": "check",
            "name": check.name,
            "rows": check.rows,
        }
        line["passed"] = check.passed
        verdict = "ok" if check.passed else "DIFFERS"
        text = f"{verdict:<8} {check.name:<{width}} {check.rows:>6} rows"
        if check.worst < float("inf"):
            line["share_of_bound"] = round(check.worst, 6)
        if check.row is not None:
            line |= {
                "worst_row": check.row,
                "seen": check.seen,
                "expected": check.expected,
            }
        if not check.passed:
            seen, expected = (
                " ".join(str(x).split()) for x in (check.seen, check.expected)
            )
            text += f"; the worst is row {check.row}: {seen} instead of {expected}"
        output.event(line, text)
    failed = [check.name for check in checks if not check.passed]
    if any(name.endswith("distances") for name in failed):
        LOG.error(
            "every engine that computes in float64 gives the same distances; this "
            "machine may run "
            "the model in float32, which ONNX Runtime does not"
        )
    if failed:
        LOG.error(f"results that differ from the golden file: {', '.join(failed)}")
    else:
        output.text(f"all {len(checks)} results agree with the golden file")
    return 1 if failed else 0
