"""Draw recordings.

Draws a recording: frames over time with the contact region, and the three features;
with --model, its curves over those of the nearest training trials. Draws several
recordings side by side, with the decisions of --model.
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
    text = "draw the reasons for its decision on a recording, its decisions on several"
    add_file(parser, "model", text)
    text = "with --model, the folder of the training trials (default: that of the recording)"
    option("--data", type=Path, metavar="DIR", help=text)
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

    models, recordings = apart(arguments.recording, arguments.model)
    if len(models) > 1 or not recordings:
        raise InputError("give recordings to draw, and at most one model.onnx")
    first = recordings[0]
    out = Path(arguments.out or Path(first).with_suffix(".png"))
    several = len(recordings) > 1
    if arguments.dark and not several:
        raise InputError("--dark is for several recordings")
    model = Model(models[0]) if models else None
    if several:
        from train.draw import comparison

        touches = [(path, load(path)) for path in recordings]
        comparison.draw(touches, out, model=model, dark=arguments.dark)
    elif model is not None:
        from train.draw import explanation

        explanation.draw(
            load(first),
            out,
            model,
            arguments.data or Path(first).parent,
            first,
        )
    else:
        from train.draw.recording import draw

        draw(load(first), out, where=first)
    print(out)
    return 0
