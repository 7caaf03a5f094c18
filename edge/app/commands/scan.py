"""Show which chips answer, as a map of the skin.

Sets up every chip, reads some frames, and prints each chip's state and a map of the
skin: # is a taxel with a valid value, . one without, and a blank one without a chip.
The exit status is 1 if a chip does not answer or a taxel has no valid value. Taxels
that rest below their calibration are counted: something may have touched them then.
"""

import argparse

import numpy as np

from edge.app.options import add_skin
from edge.app.output import LOG, Output
from edge.app.source import chip_event, open_skin
from edge.errors import counted
from edge.wire.skin.loop import Loop
from edge.wire.skin.skin import ChipStatus, Skin

FRAMES = 30
"""A microcontroller that hangs serves the same frame over and over, which shows after
25."""
SILENT = "taxels without a valid value"


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the command's options."""
    add_skin(parser)


def below_rest(skin: Skin) -> int:
    """The number of taxels that rest below their calibration by the threshold, which no
    touch does; 0 without a threshold, as noise does too."""
    threshold = skin.layout.threshold_counts
    raw, valid = skin.raw()
    below = skin.baseline.change(raw.ravel()) < -threshold
    return int((below & valid.ravel()).sum()) if threshold else 0


def run(arguments: argparse.Namespace) -> int:
    """Print each chip and the map; 1 if a chip is silent or a taxel is not valid."""
    output = Output.of(arguments)
    with open_skin(arguments, calibrated=False) as opened:
        skin = opened.skin
        for _ in Loop(skin, lasts_s=FRAMES * skin.period_s).frames():
            pass
        invalid = skin.invalid_for > 0
        below = below_rest(skin) if skin.file.calibration else 0
        statuses = skin.status()
    silent = 0
    for status in statuses:
        bad = int(invalid.flat[status.spec.served].sum())
        if status.state != "running" or bad == len(status.spec.served):
            silent += 1
        _say(output, status, bad)
    served = skin.file.served
    marks = np.full(invalid.shape, " ")
    marks.flat[served] = np.where(invalid.flat[served], ".", "#")
    for i, row in enumerate(marks.tolist()):
        output.text(f"{i:3} |{''.join(row)}|")
    answer = f"{len(statuses) - silent} of {len(statuses)} chips answer"
    if invalid.any():
        answer += f"; {SILENT}: {invalid.sum()}"
    output.text(answer)
    if below:
        LOG.warning(
            f"{counted(below, 'taxel')} below the rest value of the calibration: if "
            "something touched the skin then, calibrate again with nothing on it"
        )
    return int(silent > 0 or invalid.any())


def _say(output: Output, status: ChipStatus, bad: int) -> None:
    """Print a chip's state; for a person, only if it has a fault or invalid taxels.

    Args:
        output: takes the line.
        status: of the chip.
        bad: how many of its taxels are not valid.
    """
    spec = status.spec
    fault = status.error
    if bad and not fault:
        fault = f"{spec.route}: {SILENT}: {bad}"
    if output.as_json or fault:
        event = chip_event(status, kind=spec.kind.name, invalid=bad)
        output.event(event, f"{spec.kind.name}: {fault}")
