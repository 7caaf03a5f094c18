"""What a user says of the values in a file: options of the command, and their record."""

import argparse
import re
from collections.abc import Sequence
from dataclasses import dataclass, fields
from itertools import permutations
from typing import Self

from edge.app.options import within
from train.importers.axes import LETTERS, Axes

UNITS_S = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}


def shape_of_skin(text: str) -> tuple[int, int]:
    """The rows and columns of `--shape`.

    Raises:
        ArgumentTypeError: the text is no shape.
    """
    shape = re.fullmatch(r"([0-9]{1,4})x([0-9]{1,4})", text)
    if shape is None:
        raise argparse.ArgumentTypeError(
            f"must be ROWSxCOLS, such as 16x24, not {text[:40]!r}"
        )
    return int(shape[1]), int(shape[2])


def add_value_options(parser: argparse.ArgumentParser) -> None:
    """Add options on the meaning of values."""
    add = parser.add_argument
    add(
        "--shape",
        type=shape_of_skin,
        metavar="ROWSxCOLS",
        help="of the skin (default: as the file tells it, or one row)",
    )
    sense = parser.add_mutually_exclusive_group().add_argument
    sense(
        "--falls",
        action="store_true",
        help="values fall under pressure: subtract them from those at rest, which are "
        "those of the trial with the quietest start",
    )
    sense(
        "--signed",
        action="store_true",
        help="values rise and fall: count how far they are from those at rest",
    )
    sense(
        "--counts",
        action="store_true",
        help="values are counts as they stand, though they do not rest near 0",
    )
    add(
        "--scale",
        type=within(float, 1e-12, 1e12),
        default=1.0,
        help="counts in a unit of values with fractions",
    )
    add(
        "--missing",
        type=float,
        action="append",
        metavar="VALUE",
        help="stands for a missing value; may be given again",
    )
    add(
        "--axes",
        type=str.lower,
        choices=[*map("".join, permutations(LETTERS))],
        metavar="XYZ",
        help="taxels of three axes, such as s1_x, s1_y, s1_z: the letters of the axes "
        "along the rows, around the columns, and of the normal force",
    )
    add(
        "--flip",
        type=str.lower,
        choices=("x", "y", "z", "xy", "xz", "yz", "xyz"),
        metavar="XYZ",
        help="letters of the axes whose sign is turned round",
    )


def add_table_options(parser: argparse.ArgumentParser) -> None:
    """Add options for the facts that a table lacks."""
    add = parser.add_argument
    time = parser.add_mutually_exclusive_group().add_argument
    time(
        "--rate",
        # A higher rate must be a mistake.
        type=within(float, 1e-3, 1e6),
        metavar="HZ",
        help="frames a second, without a time",
    )
    add(
        "--frames",
        action="store_true",
        help="a folder is a trial, and a file in it a frame, named by its time in "
        "seconds, or by its number if --rate is given",
    )
    add(
        "--trials",
        action="store_true",
        help="a file of arrays holds several trials: cells, structures, or a first axis",
    )
    time("--time", metavar="COL", help="the time (default: a column of such a name)")
    add(
        "--time-unit",
        choices=(*UNITS_S, "iso"),
        help="unit of the times (default: by name or steps, where they leave no doubt)",
    )
    add("--taxels", metavar="COLS", help="the taxels (default: by running numbers)")
    add("--joints", metavar="COLS", help="joint angles in radians")
    add("--degrees", action="store_true", help="joint angles are in degrees")
    onset = parser.add_mutually_exclusive_group().add_argument
    onset(
        "--onset-column",
        metavar="COL",
        help="a touch begins where this column leaves its first value: a gripper's "
        "command, or a marker",
    )
    onset(
        "--onset",
        choices=["first"],
        help="a touch begins with the first frame of each recording",
    )
    add("--axis", type=within(int, 1, 4), help="axis of time of arrays, from 1")
    add(
        "--label",
        metavar="N|folder|COL",
        help="where labels are: the N-th word of each file's name, the folder's name, or "
        "a column",
    )
    add(
        "--task",
        default="object",
        help="the task of these labels (default: %(default)s)",
    )
    add_value_options(parser)


@dataclass(frozen=True, kw_only=True)
class ValueOptions:
    """The options on the meaning of values, by their names; `axes` with their signs."""

    shape: tuple[int, int] | None = None
    falls: bool = False
    signed: bool = False
    counts: bool = False
    scale: float = 1.0
    missing: Sequence[float] | None = None
    axes: Axes | None = None

    @classmethod
    def of(cls, arguments: argparse.Namespace) -> Self:
        """The record of parsed options.

        Raises:
            InputError: axes are turned round that are not named.
        """
        words = {field.name: getattr(arguments, field.name) for field in fields(cls)}
        words["axes"] = Axes.of(arguments.axes, arguments.flip)
        return cls(**words)


@dataclass(frozen=True, kw_only=True)
class TableOptions(ValueOptions):
    """The options for the facts that a table lacks, by their names."""

    rate: float | None = None
    frames: bool = False
    trials: bool = False
    time: str | None = None
    time_unit: str | None = None
    taxels: str | None = None
    joints: str | None = None
    degrees: bool = False
    onset_column: str | None = None
    onset: str | None = None
    label: str | None = None
    axis: int | None = None
    task: str = "object"


@dataclass(frozen=True, kw_only=True)
class LogOptions(ValueOptions):
    """The options for a log; `field` names the values in a sensor's own message."""

    field: str | None = None
