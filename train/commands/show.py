"""Draw a recording or a map of touch.

Draws a recording: frames over time with the region found, and the three features; with --scene,
what happens, seen from the side; with --model, its curves over those of the nearest training
trials. Draws several recordings side by side, with the decisions of --model. Draws a map that
`edge-classify run --map` wrote: where things were touched, and what they were.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from edge.errors import InputError


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the command's options."""
    parser.add_argument(
        "recording", nargs="+", help="an .npz recording, several to compare, or a map"
    )
    parser.add_argument(
        "--model",
        metavar="model.onnx",
        help="show why it decides so on a recording, its decisions on several, or its skin or arm "
        "behind a map",
    )
    parser.add_argument(
        "--data", type=Path, metavar="DIR",
        help="with --model, the folder of the training trials (default: that of the recording)",
    )  # fmt: skip
    parser.add_argument(
        "--out", metavar="PNG", help="the picture to write (default: beside the recording)"
    )
    parser.add_argument(
        "--scene", action="store_true", help="sketch arm, contact and its path from the side too"
    )
    parser.add_argument(
        "--dark", action="store_true", help="draw several recordings for a dark page"
    )
    parser.add_argument(
        "--threshold", type=int, metavar="COUNTS", help="threshold, instead of the skin's"
    )
    parser.add_argument(
        "--task", help="on a map, the task whose labels are shown (default: category)"
    )


def run(arguments: argparse.Namespace) -> int:
    """Draw, and say where."""
    from edge.model.model import Model
    from edge.recording import load

    first = arguments.recording[0]
    out = Path(arguments.out or Path(first).with_suffix(".png"))
    single = len(arguments.recording) == 1 and Path(first).suffix == ".npz"
    if arguments.model is not None and single and (arguments.scene or arguments.threshold):
        raise InputError(
            "--model draws other curves than --scene and --threshold; give one of them"
        )
    if arguments.dark and len(arguments.recording) == 1:
        raise InputError("--dark is for several recordings")
    if len(arguments.recording) > 1:
        from train.draw import comparison

        if arguments.scene or arguments.threshold is not None:
            raise InputError("--scene and --threshold are for a single recording")
        model = None if arguments.model is None else Model(arguments.model)
        touches = [(path, load(path)) for path in arguments.recording]
        comparison.draw(touches, out, model=model, dark=arguments.dark)
    elif Path(first).suffix != ".npz":
        from edge.runtime.touch_map import TouchMap
        from train.draw import touch_map as picture

        info = None if arguments.model is None else Model(arguments.model).info
        picture.draw(TouchMap(first), out, first, arguments.task, info)
    elif arguments.model is not None:
        from train.draw import explanation

        folder = arguments.data or Path(first).parent
        explanation.draw(load(first), out, Model(arguments.model), folder, first)
    else:
        from train.draw.recording import draw

        draw(load(first), out, where=first, scene=arguments.scene, threshold=arguments.threshold)
    print(out, file=sys.stdout)
    return 0
