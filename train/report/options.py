"""Options of the commands that write a report."""

import argparse
from pathlib import Path

from joblib import cpu_count

from edge.app.options import within


def add_report_options(parser: argparse.ArgumentParser, out: str) -> None:
    """Add the recordings, the folder, by default `out`, and the processes."""
    option = parser.add_argument
    option(
        "--data",
        nargs="+",
        required=True,
        metavar="REC",
        help=".npz recordings or folders",
    )
    option(
        "--out",
        type=Path,
        default=Path(out),
        help="folder (default: %(default)s)",
    )
    option(
        "--jobs",
        type=within(int, 1, 1000),
        default=cpu_count(),
        help="processes (default: all cores)",
    )
