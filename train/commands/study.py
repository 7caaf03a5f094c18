"""Repeat every analysis of the paper on a data set, beside the paper's own numbers.

Writes OUT/report.html (nothing outside it is linked), each plot as PNG and each table as CSV.
"""

from __future__ import annotations

import argparse
import os
from pathlib import Path


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the command's options."""
    parser.add_argument(
        "--data", nargs="+", required=True, metavar="REC", help=".npz recordings or folders"
    )
    parser.add_argument(
        "--scene",
        help="the scene that the recordings were simulated from: adds what needs simulating anew "
        "(speeds, stiffness, sensor effects) and the paper's numbers",
    )
    parser.add_argument(
        "--out", type=Path, default=Path("build/study"), help="folder (default: %(default)s)"
    )
    parser.add_argument(
        "--jobs", type=int, default=os.cpu_count() or 1, help="processes (default: all cores)"
    )
    parser.add_argument(
        "--seeds",
        type=int,
        default=1,
        help="data sets of the scene whose mean is set beside the paper's numbers (default: 1, "
        "these recordings alone; with 8, each takes about half a minute)",
    )
    parser.add_argument(
        "--address", help="address of a Dask scheduler that runs the sweeps instead"
    )


def run(arguments: argparse.Namespace) -> int:
    """Work and write."""
    from train.study.run import study

    report = study(
        arguments.data,
        arguments.out,
        scene=arguments.scene,
        jobs=arguments.jobs,
        address=arguments.address,
        seeds=arguments.seeds,
    )
    print(report)
    return 0
