"""Show what accuracy costs in time: waiting, the wire, arithmetic.

Writes OUT/report.html (nothing outside it is linked), each plot as PNG, each table as CSV, and
front.json, which `python -m export --front` reads.
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
        "--board",
        required=True,
        metavar="board.json",
        help="what `edge-classify bench` wrote of a model that was fitted on these recordings",
    )
    parser.add_argument(
        "--prices",
        metavar="prices.json",
        help="what `python -m export.prices` wrote of these recordings: shows what "
        "components, neighbours and training rows cost",
    )
    parser.add_argument(
        "--scene", help="the scene that they were simulated from: adds the physical limit"
    )
    parser.add_argument(
        "--task",
        help="task of the picture and of front.json (default: category, or else the first)",
    )
    parser.add_argument(
        "--out", type=Path, default=Path("build/tradeoff"), help="folder (default: %(default)s)"
    )
    parser.add_argument(
        "--jobs", type=int, default=os.cpu_count() or 1, help="processes (default: all cores)"
    )


def run(arguments: argparse.Namespace) -> int:
    """Work and write."""
    from train.tradeoff.run import tradeoff

    report = tradeoff(
        arguments.data,
        arguments.out,
        arguments.board,
        scene_path=arguments.scene,
        jobs=arguments.jobs,
        main=arguments.task,
        prices_path=arguments.prices,
    )
    print(report)
    return 0
