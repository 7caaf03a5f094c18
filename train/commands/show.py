"""Draw recordings.

Draws the first contact of each recording: the skin at its strongest frame and the three
features, and the decisions of --model.
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
        help="an .npz recording, or several side by side",
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
        help="draw for a dark page",
    )


def run(arguments: argparse.Namespace) -> int:
    """Draw, and say where."""
    from edge.decide.model import Model
    from edge.record.recording import load
    from train.draw import draw

    models, recordings = apart(arguments.recording, arguments.model)
    if len(models) > 1 or not recordings:
        raise InputError("give recordings to draw, and at most one model.onnx")
    out = Path(arguments.out or Path(recordings[0]).with_suffix(".png"))
    touches = [(path, load(path)) for path in recordings]
    model = Model(models[0]) if models else None
    draw(touches, out, model=model, dark=arguments.dark)
    print(out)
    return 0
