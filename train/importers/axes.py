"""Taxels of three axes in a table: which columns belong to which axis of which taxel."""

import argparse
import re
from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from edge.config import shown
from edge.errors import InputError
from train.importers.reading import Table, numbers_of

LETTERS = "xyz"
LAST = re.compile(r"(?P<stem>.*?\d)[ _.-]*(?P<axis>[xyz])", re.I)
"""A name that ends in its axis, such as s1_x or force2Z."""
FIRST = re.compile(r"(?P<word>[a-z]*?)(?P<axis>[xyz])[ _.-]*(?P<rest>\d.*)", re.I)
"""A name with its axis before its number, such as Fx_1, z12, or x.3 of an array x."""


def axis_letters(text: str) -> str:
    """The letters of the axes along the rows, around the columns, and of the normal.

    Raises:
        ArgumentTypeError: they are not x, y and z in some order.
    """
    if sorted(text.lower()) != list(LETTERS):
        raise argparse.ArgumentTypeError(
            f"must be x, y and z in some order, such as xyz, not {text[:20]!r}"
        )
    return text.lower()


def flipped_letters(text: str) -> str:
    """The letters of the axes whose sign is turned round.

    Raises:
        ArgumentTypeError: one of them is not x, y or z.
    """
    if not text or not set(text.lower()) <= set(LETTERS):
        raise argparse.ArgumentTypeError(
            f"must be some of x, y and z, such as x or xz, not {text[:20]!r}"
        )
    return text.lower()


@dataclass(frozen=True)
class Axes:
    """How the axes of a taxel are named.

    Attributes:
        along, around, normal: the letter of each axis.
        flipped: letters of the axes whose sign is turned round.
    """

    along: str
    around: str
    normal: str
    flipped: str = ""

    @classmethod
    def of(cls, options: argparse.Namespace) -> "Axes | None":
        """The axes that the options name; None for one axis.

        Raises:
            InputError: axes are turned round that are not named.
        """
        if options.axes is not None:
            along, around, normal = options.axes
            return cls(along, around, normal, options.flip or "")
        if options.flip:
            raise InputError("--flip needs --axes, such as --axes xyz")
        return None

    def split(
        self, values: NDArray[np.float64], where: object
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Normal values (n, taxels) and shear (n, taxels, 2) of values (n, ..., 3) of
        x, y and z.

        Raises:
            InputError: the values of a taxel are not three.
        """
        if values.shape[-1] != 3:
            raise InputError(
                f"{where}: --axes needs values of x, y and z, not {values.shape[1:]}"
            )
        signs = [-1.0 if letter in self.flipped else 1.0 for letter in LETTERS]
        turned = values.reshape(len(values), -1, 3) * signs
        places = [LETTERS.index(letter) for letter in (self.along, self.around)]
        return turned[..., LETTERS.index(self.normal)], turned[..., places]

    @property
    def text(self) -> str:
        """What was taken, in words."""
        turned = f", {' and '.join(self.flipped)} turned round" if self.flipped else ""
        return (
            f"shear: {self.along} along the rows, {self.around} around the columns"
            f"{turned}"
        )


@dataclass(frozen=True)
class Parted:
    """A table whose taxels have three axes.

    Attributes:
        whole: the table as it stands.
        table: its normal axis, by names without the letter, and all other columns.
        columns: {name of a taxel: {letter of an axis: its column in the whole table}}.
    """

    whole: Table
    table: Table
    columns: Mapping[str, Mapping[str, str]]

    def values(self, taxels: Sequence[str]) -> NDArray[np.float64]:
        """(n, taxels, 3) values x, y and z of some taxels.

        Raises:
            InputError: one of them has no such columns.
        """
        for name in taxels:
            if name not in self.columns:
                raise InputError(f"{self.whole.path}: taxel {name} has one axis alone")
        numbers = [
            numbers_of(self.whole, self.columns[name][letter])
            for name in taxels
            for letter in LETTERS
        ]
        return np.column_stack(numbers).reshape(-1, len(taxels), 3)


def lettered(name: str) -> tuple[str, str] | None:
    """The letter of a column's axis, and its name without it; None without one."""
    if last := LAST.fullmatch(name):
        return last["axis"].lower(), last["stem"]
    if first := FIRST.fullmatch(name):
        return first["axis"].lower(), first["word"] + first["rest"]
    return None


def parted(table: Table, normal: str) -> Parted:
    """The normal axis of a table apart from the two others.

    Columns without letters are read three by three, as x, y and z of one taxel after
    another, where the table has no header, or is an array whose last axis has three
    entries.

    Args:
        table: as it stands in the file.
        normal: letter of the normal axis.

    Raises:
        InputError: the columns of the axes do not belong together.
    """
    lettered_columns = _by_letters(table)
    columns = lettered_columns or _three_by_three(table)
    odd = sorted(taxel for taxel, axes in columns.items() if len(axes) < 3)
    if odd:
        raise InputError(
            f"{table.path}: {shown(odd[:3])} lacks one of the axes x, y, z; leave --axes "
            "out, or mend the names"
        )
    of_axes = {name for axes in columns.values() for name in axes.values()}
    normals = {axes[normal]: taxel for taxel, axes in columns.items()}
    others = [name for name in table.names if name not in of_axes]
    of_normal = [name for name in table.names if name in normals]
    data = table.data[[*others, *of_normal]].rename(columns=normals)
    if not data.columns.is_unique:
        twice = data.columns[data.columns.duplicated()][0]
        raise InputError(
            f"{table.path}: {twice} names a column and a taxel of three axes; rename one "
            "of them"
        )
    shape = table.shape if lettered_columns else ()
    part = replace(table, data=data, shape=shape, file_names=())
    return Parted(table, part, columns)


def _by_letters(table: Table) -> dict[str, dict[str, str]]:
    """{taxel: {letter: column}} of the columns whose names have a letter."""
    columns: dict[str, dict[str, str]] = defaultdict(dict)
    for name in table.names:
        if parts := lettered(name):
            letter, taxel = parts
            columns[taxel][letter] = name
    return columns


def _three_by_three(table: Table) -> dict[str, dict[str, str]]:
    """{taxel: {letter: column}} of a table whose values stand in threes.

    Raises:
        InputError: they do not.
    """
    threes = {stem: n for stem, n in table.arrays.items() if len(n) % 3 == 0}
    is_array = table.shape[-1:] == (3,)
    if (table.named and not is_array) or len(threes) != 1:
        raise InputError(
            f"{table.path}: no columns are named by an axis, such as s1_x, s1_y and "
            f"s1_z; it has {shown(table.names)}"
        )
    ((stem, names),) = threes.items()
    return {
        f"{stem}.{place + 1}".strip("."): dict(
            zip(LETTERS, names[3 * place : 3 * place + 3], strict=True)
        )
        for place in range(len(names) // 3)
    }
