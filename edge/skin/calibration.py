"""A skin's calibration: written into its file, and the dead band that follows from its
noise."""

import os
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from edge.errors import InputError
from edge.files import read_text, write_whole
from edge.skin.file import SkinFile, TaxelCalibration, parse


def calibration_text(calibration: TaxelCalibration) -> str:
    """The `[calibration]` table as TOML, one line for each row of the skin."""
    lines = ["[calibration]\n"]
    if calibration.taken is not None:
        lines.append(f"taken = {calibration.taken.isoformat(timespec='seconds')}\n")
    for key, values in (
        ("baseline", calibration.baseline),
        ("noise", calibration.noise.round(3)),
    ):
        rows = "".join(f"  {row},\n" for row in values.tolist())
        lines.append(f"{key} = [\n{rows}]\n")
    return "".join(lines)


def with_calibration(
    text: str, calibration: TaxelCalibration, where: str = "skin"
) -> str:
    """The file's text with its `[calibration]` replaced and all else kept, comments
    included.

    Raises:
        InputError: the calibration in the file has a form that cannot be replaced.
    """
    former = parse(text, where)
    table = re.compile(
        r"^[ \t]*\[calibration\][ \t]*(#.*)?\n(?:(?![ \t]*\[\[?[ \t]*[A-Za-z_\"']).*\n?)*",
        re.M,
    )
    without_table = table.sub("", text if text.endswith("\n") else text + "\n").rstrip(
        "\n"
    )
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


def dead_band(skin: SkinFile) -> NDArray[np.int32]:
    """(rows * cols,) counts under which a taxel reads 0; at least 1: no count is
    negative."""
    noise = (
        np.zeros(skin.layout.shape)
        if skin.calibration is None
        else skin.calibration.noise
    )
    sigma = np.ceil(np.minimum(skin.signal.dead_band_sigma * noise.ravel(), 65535.0))
    return np.maximum(max(1, skin.signal.dead_band_counts), sigma.astype(np.int32))
