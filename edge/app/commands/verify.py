"""Check that this machine computes the workstation's results.

Runs the frames and feature vectors of a golden file on this machine, and compares every
result with the stored one, to the last bit.
The exit status is 1 if a result differs.
"""

import argparse
from dataclasses import asdict

from edge.app.options import add_engine, add_file
from edge.app.output import LOG, Output
from edge.decide.model import Model
from edge.decide.verify import golden_of, verify


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the command's options."""
    add_file(parser, "model", "the model to check", needed=True)
    parser.add_argument(
        "--golden",
        help="golden.npz, written together with the model (default: that which `install` "
        "put beside it)",
    )
    add_engine(parser)


def run(arguments: argparse.Namespace) -> int:
    """Print one line per result; 1 if one differs."""
    output = Output.of(arguments)
    model = Model(arguments.model, arguments.engine)
    checks = verify(model, arguments.golden or golden_of(model.path, model.version))
    width = max(len(check.name) for check in checks)
    for check in checks:
        event = {"event": "check", **asdict(check), "passed": check.passed}
        verdict = "ok" if check.passed else "DIFFERS"
        text = f"{verdict:<8} {check.name:<{width}} {check.rows:>6} rows"
        if not check.passed:
            value = " ".join(check.value.split())
            expected = " ".join(check.expected.split())
            text += f"; the first is row {check.row}: {value} instead of {expected}"
        output.event(event, text)
    failed = [check.name for check in checks if not check.passed]
    if failed:
        LOG.error(f"results that differ from the golden file: {', '.join(failed)}")
    else:
        output.text(f"all {len(checks)} results agree with the golden file")
    return 1 if failed else 0
