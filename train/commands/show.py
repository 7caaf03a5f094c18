"""Draw recordings.

Draws a recording: frames over time with the contact region, and the three features.
Draws several recordings, or the decisions of --model, side by side.
"""

import argparse
from pathlib import Path

from edge.app.options import add_file, apart
from edge.errors import InputError


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the command's options."""
    option = parser.add_argument
    option(
        "recording",
        nargs="+",
        help="an .npz recording, or several to compare",
    )
    text = "whose decisions are drawn"
    add_file(parser, "model", text)
    option(
        "--out",
        metavar="PNG",
        help="the picture to write (default: beside the recording)",
    )
    option(
        "--dark",
        action="store_true",
        help="draw several recordings for a dark page",
    )


def run(arguments: argparse.Namespace) -> int:
    """Draw, and say where."""
    from edge.decide.model import Model
    from edge.record.recording import load
    from train.draw import comparison
    from train.draw.recording import draw

    models, recordings = apart(arguments.recording, arguments.model)
    if len(models) > 1 or not recordings:
        raise InputError("give recordings to draw, and at most one model.onnx")
    first = recordings[0]
    out = Path(arguments.out or Path(first).with_suffix(".png"))
    if models or len(recordings) > 1:
        touches = [(path, load(path)) for path in recordings]
        model = Model(models[0]) if models else None
        comparison.draw(touches, out, model=model, dark=arguments.dark)
    elif arguments.dark:
        raise InputError("--dark is for several recordings")
    else:
        draw(load(first), out, where=first)
    print(out)
    return 0
