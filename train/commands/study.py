"""`python -m train study`: the paper's analyses on a data set."""

from __future__ import annotations

import argparse
import os
from pathlib import Path

HELP = "every analysis of the paper on a data set, ours beside the paper's"
DESCRIPTION = (
    "Writes OUT/report.html (nothing outside it is linked), each plot as PNG and each table as CSV."
)


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
        "--out", type=Path, default=Path("build/study"), help="folder (build/study)"
    )
    parser.add_argument(
        "--jobs", type=int, default=os.cpu_count() or 1, help="processes (all cores)"
    )
    parser.add_argument(
        "--seeds",
        type=int,
        default=1,
        help="data sets of the scene whose mean stands beside the paper's numbers (1: these "
        "recordings alone; 8 take about half a minute each)",
    )
    parser.add_argument("--address", help="of a Dask scheduler that runs the sweeps instead")


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
