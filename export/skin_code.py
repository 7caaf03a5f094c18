"""A skin as C99 for a microcontroller: the files of `export/c/skin`, of which
`skin_data.h` and `skin_data.c` take the numbers of a skin file and of its drivers."""

from __future__ import annotations

import json
import math
import zlib
from collections.abc import Iterator
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np

from edge.errors import InputError
from edge.wire.bus import protocol, retrying
from edge.wire.chips import ad7147, mpr121
from edge.wire.chips.chip import MOST_TAXELS, ChipSpec, Script, Step
from edge.wire.chips.kinds import KINDS
from edge.wire.skin import bus_reader, calibration, decoder, lone
from edge.wire.skin.file import Signal, SkinFile
from edge.writing import write_whole
from export.c_text import array, literal, write_rooms
from export.image import ROOMS

HZ = 1_000_000
"""Ticks a second of the firmware's clock."""
OUTCOMES = (
    protocol.BusNack,
    protocol.BusFault,
    protocol.BusTimeout,
    protocol.BusArbitration,
    protocol.BusRefused,
    protocol.BusError,
)
"""The errors, in the order of `ec_i2c_outcome` behind its first."""
UNREADABLE = 65535
"""What a recorder sends of a taxel that it could not read."""
BAUD = 2_000_000
SIZES = {"rows": "skin_rows", "cols": "skin_cols", "wraps": "skin_wraps"}
"""{attribute of a layout: its name in C}, where the model has the shorter one."""
NUMBERS: tuple[tuple[Any, tuple[str, ...]], ...] = (
    (retrying, ("MOST_CREDIT", "RESTS")),
    (bus_reader, ("SET_UP_AFTER", "SET_UP_EVERY", "OLDEST_FRAMES")),
    (lone, ("FEWEST_NEIGHBOURS",)),
    (ad7147, ("IDENTIFIED_EVERY", "IDENTITY")),
    (mpr121, ("SATURATED",)),
    (calibration, ("FEWEST_FRAMES", "NOISY", "NOISY_COUNTS")),
    (decoder, ("COARSE",)),
)
"""Constants that have the same names in C, as have these keys of a skin file."""
OF_SIGNAL = ("dead_band_sigma", "drift_limit_counts")
OF_READING = ("verify_mux", "recheck_frames", "stuck_frames")


def export(
    file: SkinFile,
    folder: Path,
    touch_counts: int = UNREADABLE,
    hz: int = HZ,
) -> str:
    """Write a skin's C, and the skin file that records through it; say so.

    Args:
        file: the skin's.
        folder: that is made.
        touch_counts: a lower threshold of a model, above which no baseline follows.
        hz: ticks a second of the clock.

    Raises:
        InputError: C lacks something that the skin needs, or the folder cannot be
            written.
    """
    taxels = file.layout.rows * file.layout.cols
    if file.layout.axes or taxels > MOST_TAXELS:
        raise InputError(
            f"{file.path}: cannot be written in C, which reads one axis of at most "
            f"{MOST_TAXELS} taxels"
        )
    numbers = _numbers(file, hz)
    numbers["touch_counts"] = min(touch_counts, file.layout.threshold_counts)
    lines = [f"#define EC_{key.upper()} {literal(n)}" for key, n in numbers.items()]
    tables = {key: literal(value) for key, value in _tables(file, hz).items()}
    write_rooms(ROOMS / "skin", folder, {"numbers": "\n".join(lines), **tables})
    with write_whole(folder / "record.toml") as out:
        out.write("".join(_recorder(file)).encode())
    calibrated = "calibrated" if file.calibration else "which ec_calibrate calibrates"
    return f"{folder}: the skin {file.name!r}, {calibrated}; record with record.toml"


def _numbers(file: SkinFile, hz: int) -> dict[str, Any]:
    """The constants by their names in C, without EC_."""
    signal = file.signal
    rate_hz = file.reading.rate_hz
    period = round(hz / rate_hz)
    scale = 1 << decoder.SCALE_BITS
    answers = [len(step.answer) for chip in file.chips for step in steps(chip.script)]
    named = (*NUMBERS, (signal, OF_SIGNAL), (file.reading, OF_READING))
    numbers = {name: getattr(of, name) for of, names in named for name in names}
    kinds = {chip.kind.name for chip in file.chips}
    numbers |= {f"has_{name}": name in kinds for name in KINDS}
    numbers |= {name: getattr(file.layout, key) for key, name in SIZES.items()}
    return (
        numbers
        | _times(signal, hz)
        | {
            "hz": hz,
            "period": period,
            "oldest": bus_reader.OLDEST_FRAMES * period,
            "skin_threshold": file.layout.threshold_counts,
            "skin_onset": file.layout.onset,
            "buses": len(file.buses),
            "chips": len(file.chips),
            "bytes": sum(chip.traits.frame_bytes for chip in file.chips),
            "most_answer": max(answers),
            "frames_of_conversion": 1 + math.ceil(decoder.CONVERSION_S * rate_hz),
            "chance": math.exp(decoder.LOG_CHANCE),
            "repeats_of_1": 0.5 / math.sqrt(math.pi),
            "standing_out": int(calibration.SPREADS),
            "dead_band_counts": max(1, signal.dead_band_counts),
            "drift_step": math.ceil(signal.drift_counts_per_s / rate_hz * scale),
            "reach": signal.saturation_counts + signal.drift_limit_counts,
        }
    )


def _times(signal: Signal, hz: int) -> dict[str, int]:
    """Times in ticks: ages reach some, and others are not exceeded."""
    at_least = {
        "longest_rest": retrying.LONGEST_REST_S,
        "held": decoder.HELD_S,
        "silent": lone.SILENT_S,
        "alone": lone.ALONE_S,
        "alone_at_start": lone.ALONE_AT_START_S,
        "settle": signal.settle_s,
    }
    at_most = {"longest_step": bus_reader.LONGEST_STEP_S, "lone_start": lone.START_S}
    ticks = {name: math.ceil(seconds * hz) for name, seconds in at_least.items()}
    return ticks | {name: math.floor(s * hz) for name, s in at_most.items()}


def steps(script: Script) -> list[Step]:
    """All steps, in C's order."""
    return [script.identify, *script.checks, *script.settings]


def _tables(file: SkinFile, hz: int) -> dict[str, Any]:
    """The tables by their names in `skin_data.c`."""
    taxels = decoder.taxel_map(file)
    ends = np.cumsum([0, *(len(bus.chips) for bus in file.buses)])
    scripts: list[str] = []
    chips = []
    first_byte = 0
    for bus, spec in enumerate(file.buses):
        for chip in spec.chips:
            script = _script(chip.script, hz)
            if script not in scripts:
                scripts.append(script)
            chips.append(_chip(chip, bus, scripts.index(script), first_byte))
            first_byte += chip.traits.frame_bytes
    return {
        "retries": [0, *(error.retries for error in OUTCOMES)],
        "first_chips": ends,
        "working": taxels.served,
        "signs": taxels.sign,
        "calibration": _calibration(file),
        "scripts": scripts,
        "chips": chips,
    }


def _script(script: Script, hz: int) -> str:
    """An `ec_script`."""
    rows = [
        [
            array("uint8_t", step.out),
            array("uint8_t", step.answer),
            array("uint8_t", step.bits or b"\xff" * len(step.answer)),
            len(step.out),
            len(step.answer),
            math.ceil(step.wait_s * hz),
        ]
        for step in steps(script)
    ]
    return literal([array("ec_script_step", rows), len(script.checks), len(rows)])


def _chip(chip: ChipSpec, bus: int, script: int, first_byte: int) -> list[Any]:
    """An `ec_chip`."""
    kind = chip.kind
    return [
        f"&scripts[{script}]",
        array("int16_t", chip.taxels),
        array("uint8_t", kind.frame_pointer),
        first_byte,
        chip.traits.frame_bytes,
        len(chip.taxels),
        chip.traits.highest,
        len(kind.frame_pointer),
        f"EC_{kind.name.upper()}",
        chip.option("bits") if "bits" in kind.options else 0,
        bus,
        chip.address,
        chip.mux or 0,
        chip.channel or 0,
        kind.rests_at_zero,
    ]


def _calibration(file: SkinFile) -> list[Any]:
    """An `ec_calibration`; without one, rest values of 0."""
    calibration = file.calibration
    wiring = replace(file, calibration=None, path="", labels={})
    noise = np.zeros(file.layout.shape) if calibration is None else calibration.noise
    rest = np.zeros_like(noise) if calibration is None else calibration.baseline
    return [
        zlib.crc32(repr(wiring).encode()),
        np.minimum(decoder.stuck_limits(file), 2**32 - 1),
        rest.ravel().astype(int),
        decoder.dead_band(file.signal, noise).ravel(),
        calibration is not None,
        0,
    ]


def _recorder(file: SkinFile) -> Iterator[str]:
    """Lines of the skin file of a workstation that records through the board.

    Raises:
        InputError: the chips have different signs.
    """
    signs = {chip.sign for chip in file.chips}
    if len(signs) > 1:
        raise InputError(f"{file.path}: C records chips of one sign alone")
    signal = asdict(file.signal)
    rests = [chip.traits.rest for chip in file.chips]
    rest = max(rests) if file.calibration is None else file.calibration.baseline.max()
    # Beyond it lies what says that a taxel could not be read.
    reach = UNREADABLE - 1 - int(rest) - file.signal.drift_limit_counts
    signal["saturation_counts"] = max(1, min(signal["saturation_counts"], reach))
    served = set(file.served)
    cols = file.layout.cols
    taxels = range(file.layout.rows * cols)
    places = [[*divmod(i, cols)] if i in served else [] for i in taxels]
    tables = {
        "[skin]": {"name": file.name, **file.layout.to_dict()},
        "[signal]": {**signal, "sign": signs.pop()},
        "[read]": asdict(file.reading),
        "[labels]": file.labels,
        "[[bus]]": {"serial": "/dev/ttyACM0", "baud": BAUD, "kind": "block"},
        "[[bus.chips]]": {"taxels": places},
    }
    yield "# The skin, as a board serves it: put in its serial port, and calibrate.\n"
    for name, table in tables.items():
        yield f"\n{name}\n"
        yield from (f"{key} = {json.dumps(value)}\n" for key, value in table.items())
