"""Make labelled touches for a skin file, to rehearse before it is wired.

Maps the simulated touches that come with the program onto the geometry of a skin, and
writes them as labelled recordings, with one more in which nothing touches the skin.
Play them with --fake to rehearse calibrate, record, export and run. A model that is
fitted to them knows nothing about the real skin.
"""

import argparse
from pathlib import Path

from edge.app.options import add_file, within
from edge.app.output import Output
from edge.record.saving import save
from edge.wire.fake.touches import still, touches
from edge.wire.skin.file import load
from edge.writing import remove_leftovers

TRIALS = 12
"""Enough of each touch for a trade-off."""
STILL_S = 5.0


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the command's options."""
    add_file(parser, "skin", "the file that describes the skin", needed=True)
    parser.add_argument(
        "--out", type=Path, required=True, metavar="DIR", help="the folder to write to"
    )
    parser.add_argument(
        "--trials",
        type=within(int, 1, 1000),
        default=TRIALS,
        help="number of trials of each touch (default: %(default)s)",
    )
    parser.add_argument(
        "--seed",
        type=within(int, 0, 2**63),
        default=0,
        help="seed of the trials' variation",
    )


def run(arguments: argparse.Namespace) -> int:
    """Write the recordings and print the commands to rehearse with."""
    file = load(arguments.skin)
    output = Output.of(arguments)
    folder = arguments.out / "touches"
    rest = arguments.out / "still.npz"
    remove_leftovers(folder)
    save(rest, still(file, STILL_S))
    paths = []
    for name, recording in touches(file, trials=arguments.trials, seed=arguments.seed):
        paths.append(folder / f"{name}.npz")
        save(paths[-1], recording)
    skin = arguments.skin
    first = paths[0]
    frames = round(STILL_S * file.reading.rate_hz)
    output.event(
        {
            "event": "faked",
            "skin": skin,
            "touches": str(folder),
            "trials": len(paths),
            "still": str(rest),
        },
        f"{folder}: {len(paths)} labelled touches of 4 objects\n{rest}: no touch\n\n"
        "Rehearse with them:\n"
        f"  edge-classify calibrate --skin {skin} --fake {rest} --frames {frames} --yes\n"
        f"  edge-classify view --skin {skin} --fake {first}\n"
        f"  edge-classify record --skin {skin} --fake {first} --label object=box --out "
        "recordings\n"
        f"  make export DATA={folder}          (in a checkout, on the workstation)\n"
        f"  edge-classify run --model build/model.onnx --skin {skin} --fake {first}",
    )
    return 0
