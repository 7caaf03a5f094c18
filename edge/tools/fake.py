"""Make labelled touches for a skin file, to rehearse before it is wired.

Maps the simulated touches that come with the program onto the geometry of a skin, and
writes them as labelled recordings, with one more in which nothing touches the skin.
Play them with --fake to rehearse calibrate, record, export and run. A model that is
fitted to them knows nothing about the real skin. With --plug the skin's chips appear on
this machine's own /dev/i2c-N instead, where every program can read them, until Ctrl-C.
"""

import argparse
from contextlib import ExitStack
from pathlib import Path

from edge.commands.options import add_noise, within
from edge.commands.output import Output
from edge.commands.source import ending_signals
from edge.errors import InputError
from edge.fake.clock import PacedClock
from edge.fake.player import fake_buses, playback
from edge.fake.touches import still, touches
from edge.fake.usb_adapter import UsbAdapter, plugged
from edge.recording import load as load_recording
from edge.saving import save
from edge.skin.file import SkinFile, load
from edge.skin.loop import stop_on

TRIALS = 12
"""Enough of each touch for a trade-off."""
STILL_S = 5.0


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the command's options."""
    parser.add_argument(
        "--skin",
        required=True,
        metavar="skin.toml",
        help="the file that describes the skin",
    )
    goal = parser.add_mutually_exclusive_group(required=True)
    goal.add_argument("--out", type=Path, metavar="DIR", help="the folder to write to")
    goal.add_argument(
        "--plug",
        nargs="?",
        const="",
        metavar="REC.npz",
        help="plug a USB adapter with the skin's chips into this machine (Linux, as "
        "root); they feel this recording over and over, or nothing",
    )
    add_noise(parser, "the chips of --plug")
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


def plug(file: SkinFile, recording: str, noise: float, output: Output) -> int:
    """Keep the skin's chips on this machine's buses until a signal comes.

    Args:
        file: the skin.
        recording: the path of the recording that the chips feel over and over; without
            one (an empty path) they feel nothing.
        noise: standard deviation of the raw values, in counts.
        output: where to print the device of each bus.
    """
    for spec in file.buses:
        if spec.serial:
            raise InputError(
                f"{spec.device} is a serial port; --plug carries only I2C buses"
            )
    felt = load_recording(recording) if recording else still(file, STILL_S)
    scene = playback(file, felt, loop=True)
    clock = PacedClock()
    with stop_on(*ending_signals()) as stop, ExitStack() as adapters:
        for bus in fake_buses(file, scene, clock, noise_counts=noise):
            device = adapters.enter_context(plugged(UsbAdapter(bus)))
            output.event(
                {"event": "plugged", "bus": bus.name, "device": device},
                f"{bus.name} of the skin file is plugged in as {device}; Ctrl-C "
                "unplugs it",
            )
        while not stop.asked:
            clock.sleep_until(clock.now() + 1.0 / file.reading.rate_hz)
    return 0


def run(arguments: argparse.Namespace) -> int:
    """Write the recordings and print the commands to rehearse with, or plug the skin
    in."""
    file = load(arguments.skin)
    output = Output.of(arguments)
    if arguments.plug is not None:
        return plug(file, arguments.plug, arguments.noise, output)
    folder = arguments.out / "touches"
    rest = arguments.out / "still.npz"
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
        f"  edge-classify calibrate --skin {skin} --fake {rest} --frames {frames}\n"
        f"  edge-classify view --skin {skin} --fake {first}\n"
        f"  edge-classify record --skin {skin} --fake {first} --label object=box --out "
        "recordings\n"
        f"  make export DATA={folder}          (in a checkout, on the workstation)\n"
        f"  edge-classify run --model build/model.onnx --skin {skin} --fake {first}",
    )
    return 0
