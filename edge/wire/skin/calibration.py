"""A skin's calibration, written into its file."""

import os
import re
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path

import numpy as np

from edge.arrays import Booleans
from edge.errors import InputError
from edge.files import read_text
from edge.wire.skin.decoder import dead_band
from edge.wire.skin.file import SkinFile, TaxelCalibration, parse
from edge.writing import write_whole

CALIBRATION = re.compile(
    r"^[ \t]*\[calibration\][ \t]*(#.*)?\n"
    r"(?:(?![ \t]*\[\[?[ \t]*[A-Za-z_\"']).*\n?)*",
    re.M,
)
"""The table, up to the next one."""


def calibration_text(calibration: TaxelCalibration) -> str:
    """The `[calibration]` table as TOML, one line for each row of the skin.

    The time at which it was taken, now in UTC, is for people; no program reads it.
    """
    now = datetime.now(UTC).isoformat(timespec="seconds")
    lines = ["[calibration]\n", f"taken = {now}\n"]
    for key in ("baseline", "noise", "shear_baseline", "shear_noise"):
        array = getattr(calibration, key)
        if array is not None:
            rows = [f"  {row},\n" for row in array.round(3).tolist()]
            lines += [f"{key} = [\n", *rows, "]\n"]
    return "".join(lines)


def with_calibration(
    text: str,
    calibration: TaxelCalibration,
    where: str = "skin",
) -> str:
    """The file's text with its `[calibration]` replaced and all else kept, comments
    included.

    Raises:
        InputError: the calibration in the file has a form that cannot be replaced.
    """
    former = parse(text, where)
    ended = text if text.endswith("\n") else text + "\n"
    without_table = CALIBRATION.sub("", ended).rstrip("\n")
    new_text = f"{without_table}\n\n{calibration_text(calibration)}"
    new = parse(new_text, where)
    same = replace(former, calibration=None) == replace(new, calibration=None)
    if not same or new.calibration is None:
        raise InputError(
            f"{where}: write [calibration] as a table of its own, at the end"
        )
    return new_text


def save_calibration(
    path: str | os.PathLike[str], calibration: TaxelCalibration
) -> Path:
    """Write a calibration into a skin's file, completely or not at all, and keep the
    old file.

    Returns:
        Path of the old file, `skin.toml.bak`.

    Raises:
        InputError: the file cannot be read or written.
    """
    target = Path(path)
    former = read_text(target)
    text = with_calibration(former, calibration, os.fspath(path))
    backup = target.with_name(f"{target.name}.bak")
    for name, contents in ((backup, former), (target, text)):
        with write_whole(name) as file:
            file.write(contents.encode())
    return backup


def deaf_taxels(skin: SkinFile) -> list[tuple[int, int]]:
    """Working taxels (row, col) whose dead band reaches the contact threshold."""
    threshold = skin.layout.threshold_counts
    if not threshold:
        return []
    noise = 0.0 if skin.calibration is None else skin.calibration.noise
    band = dead_band(skin.signal, noise)
    return places((band >= threshold) & skin.layout.alive)


def places(mask: Booleans) -> list[tuple[int, int]]:
    """(row, col) of the taxels of a mask (rows, cols)."""
    return [(row, col) for row, col in np.argwhere(mask).tolist()]
