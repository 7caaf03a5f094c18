"""`edge-classify check`: whether a skin's file is right, and what frame rate its wires carry."""

from __future__ import annotations

import argparse
import json
import sys
from typing import Any

from edge.fake.player import frame_bits
from edge.skin.file import frame_rate, load

FRAMES = 100
"""Counted together, so that transactions that not every frame needs count by their share."""


def add_parser(commands: Any) -> None:
    """Add the command to the command line."""
    parser: argparse.ArgumentParser = commands.add_parser(
        "check",
        help="say what is wrong with a skin file, and what frame rate its wires carry",
        description="Reads a skin file and runs its drivers over a fake bus that counts the "
        "bits on the wire. The exit status is 1 if the wires cannot carry the frame rate that "
        "the file asks for.",
    )
    parser.add_argument("skin", metavar="skin.toml", help="the file that describes the skin")
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Print the result, and remarks on stderr."""
    file = load(arguments.skin)
    bits = [count / FRAMES for count in frame_bits(file, FRAMES)]
    clocks = [bus.clock_hz for bus in file.buses]
    rate = frame_rate(bits, clocks)
    remarks = []
    if file.uncovered:
        remarks.append(f"{file.uncovered} taxels have no chip: they are never valid")
    if file.calibration is None:
        remarks.append("not calibrated yet: run `edge-classify calibrate`")
    carried = rate >= file.reading.rate_hz
    if not carried and file.reading.region_of_interest:
        remarks.append(f"full frames come at {rate:.1f} Hz; the chips near a contact at the rate")
    elif not carried:
        remarks.append(
            f"asks for {file.reading.rate_hz:g} Hz, the wire carries {rate:.1f}: use more buses, "
            "a faster clock, a lower [read] rate_hz, or region_of_interest = true"
        )
    event = {
        "event": "check",
        "skin": file.name,
        "taxels": file.layout.rows * file.layout.cols,
        "chips": len(file.chips),
        "buses": [
            {"device": bus.device, "chips": len(bus.chips), "clock_hz": bus.clock_hz, "bits": b}
            for bus, b in zip(file.buses, bits, strict=True)
        ],
        "frame_rate_hz": round(rate, 1),
        "asked_hz": file.reading.rate_hz,
        "remarks": remarks,
    }
    print(json.dumps(event, ensure_ascii=False))
    print(f"{arguments.skin}: the wire carries {rate:.1f} frames a second", file=sys.stderr)
    for remark in remarks:
        print(f"{arguments.skin}: {remark}", file=sys.stderr)
    return 0 if carried or file.reading.region_of_interest else 1
