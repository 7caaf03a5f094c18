"""`python -m train show`: a recording as a picture."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import Any


def add_parser(subparsers: Any) -> None:
    """Add the command."""
    parser = subparsers.add_parser(
        "show",
        help="draw a recording",
        description="Draw a recording: frames over time with the region found, and the three "
        "features; with --scene, what happens, seen from the side.",
    )
    parser.add_argument("recording", help="an .npz recording")
    parser.add_argument("--out", metavar="PNG", help="the picture; beside the recording without it")
    parser.add_argument(
        "--scene", action="store_true", help="sketch arm, contact and its path from the side too"
    )
    parser.add_argument("--threshold", type=int, metavar="COUNTS", help="in place of the skin's")
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Draw, and say where."""
    from edge.recording import load
    from train.show import draw

    recording = load(arguments.recording)
    out = Path(arguments.out or Path(arguments.recording).with_suffix(".png"))
    draw(
        recording,
        out,
        where=arguments.recording,
        scene=arguments.scene,
        threshold=arguments.threshold,
    )
    print(out, file=sys.stdout)
    return 0
