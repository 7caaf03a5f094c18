"""`python -m train show`: a recording, or a map of touch, as a picture."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import Any


def add_parser(subparsers: Any) -> None:
    """Add the command."""
    parser = subparsers.add_parser(
        "show",
        help="draw a recording or a map of touch",
        description="Draw a recording: frames over time with the region found, and the three "
        "features; with --scene, what happens, seen from the side. Draw a map that "
        "`edge-classify run --map` wrote: where things were touched, and what they were.",
    )
    parser.add_argument("recording", help="an .npz recording, or a map")
    parser.add_argument("--out", metavar="PNG", help="the picture; beside the recording without it")
    parser.add_argument(
        "--scene", action="store_true", help="sketch arm, contact and its path from the side too"
    )
    parser.add_argument("--threshold", type=int, metavar="COUNTS", help="in place of the skin's")
    parser.add_argument("--task", help="of a map: which labels to show (default: category)")
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Draw, and say where."""
    from edge.recording import load
    from train.draw.recording import draw

    out = Path(arguments.out or Path(arguments.recording).with_suffix(".png"))
    if Path(arguments.recording).suffix != ".npz":
        from edge.runtime import touch_map as touchmap
        from train.draw import touch_map as showmap

        found = touchmap.load(arguments.recording)
        showmap.draw(found, out, arguments.recording, arguments.task)
        print(out, file=sys.stdout)
        return 0
    recording = load(arguments.recording)
    draw(
        recording,
        out,
        where=arguments.recording,
        scene=arguments.scene,
        threshold=arguments.threshold,
    )
    print(out, file=sys.stdout)
    return 0
