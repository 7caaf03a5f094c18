"""Taxels of three axes in a table: which columns belong to which axis of which taxel."""

import argparse
import re
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
FIRST = re.compile(r"(?P<word>[a-z]*?)(?P<axis>[xyz])(?P<rest>[ _.-]*\d.*)", re.I)
"""A name with its axis before its number, such as Fx_1, z12, or x.3 of an array x."""
LARGEST = 32767


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
    """How a table names its axes.

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
        if options.axes is None:
            if options.flip:
                raise InputError("--flip needs --axes, such as --axes xyz")
            return None
        along, around, normal = options.axes
        return cls(along, around, normal, options.flip or "")

    def sign(self, letter: str) -> float:
        """1, or -1 for an axis that is turned round."""
        return -1.0 if letter in self.flipped else 1.0

    def split(
        self, values: NDArray[np.float64], where: object
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Normal values (n, ...) and shear (n, ..., 2) of values (n, ..., 3) of x, y
        and z.

        Raises:
            InputError: the values of a taxel are not three.
        """
        if values.shape[-1] != 3:
            raise InputError(
                f"{where}: --axes needs values of x, y and z, not {values.shape[1:]}"
            )
        turned = values * [self.sign(letter) for letter in LETTERS]
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
    """A table of one axis, and where the other two are.

    Attributes:
        table: the normal axis, by names without its letter, and all other columns.
        shear: {name of a taxel: its columns along and around in the whole table}.
    """

    table: Table
    shear: Mapping[str, tuple[str, str]]


def lettered(name: str) -> tuple[str, str] | None:
    """The letter of a column's axis, and its name without it; None without one."""
    last = LAST.fullmatch(name)
    if last is not None:
        return last["axis"].lower(), last["stem"]
    first = FIRST.fullmatch(name)
    if first is not None:
        return first["axis"].lower(), first["word"] + first["rest"].lstrip(" _.-")
    return None


def parted(table: Table, axes: Axes) -> Parted:
    """The normal axis of a table apart from the two others.

    Columns without letters are read three by three, as x, y and z of one taxel after
    another, where the table has no header, or is an array whose last axis has three
    entries.

    Raises:
        InputError: the columns of the axes do not belong together.
    """
    columns: dict[str, dict[str, str]] = {letter: {} for letter in LETTERS}
    plain_names = []
    for name in table.names:
        found = lettered(name)
        if found is None:
            plain_names.append(name)
        else:
            columns[found[0]][found[1]] = name
    if not any(columns.values()):
        return three_by_three(table, axes)
    taxels = columns[axes.normal]
    for letter in (axes.along, axes.around):
        if set(columns[letter]) != set(taxels):
            odd = sorted(set(columns[letter]) ^ set(taxels))[:3]
            raise InputError(
                f"{table.path}: {shown(odd)} lacks one of the axes {axes.along}, "
                f"{axes.around}, {axes.normal}; leave --axes out, or mend the names"
            )
    shear = {
        name: (columns[axes.along][name], columns[axes.around][name]) for name in taxels
    }
    names = {column: name for name, column in taxels.items()}
    data = table.data[[*plain_names, *taxels.values()]].rename(columns=names)
    return Parted(replace(table, data=data), shear)


def three_by_three(table: Table, axes: Axes) -> Parted:
    """The normal axis of a table whose values stand in threes.

    Raises:
        InputError: they do not.
    """
    stems: dict[str, list[str]] = {}
    for name in table.names:
        stems.setdefault(name.rpartition(".")[0], []).append(name)
    threes = [(stem, names) for stem, names in stems.items() if len(names) % 3 == 0]
    array = bool(table.shape) and table.shape[-1] == 3
    if (table.named and not array) or len(threes) != 1:
        raise InputError(
            f"{table.path}: no columns are named by an axis, such as s1_x, s1_y and "
            f"s1_z; it has {shown(table.names)}"
        )
    ((stem, names),) = threes
    shear = {}
    dropped = []
    renamed = {}
    for first in range(0, len(names), 3):
        of_taxel = dict(zip(LETTERS, names[first : first + 3], strict=True))
        plain = f"{stem}.{first // 3 + 1}".strip(".")
        along = of_taxel[axes.along]
        around = of_taxel[axes.around]
        shear[plain] = along, around
        dropped += [along, around]
        renamed[of_taxel[axes.normal]] = plain
    data = table.data.drop(columns=dropped).rename(columns=renamed)
    return Parted(replace(table, data=data, shape=()), shear)


def shear_of(
    table: Table, part: Parted, taxels: Sequence[str], axes: Axes
) -> NDArray[np.float64]:
    """(n, taxels, 2) values along and around of some taxels.

    Raises:
        InputError: one of them has no such columns.
    """
    missing = next((name for name in taxels if name not in part.shear), None)
    if missing is not None:
        raise InputError(f"{table.path}: taxel {missing} has one axis alone")
    pairs = []
    for name in taxels:
        along, around = part.shear[name]
        pairs.append(
            np.column_stack(
                [
                    axes.sign(axes.along) * numbers_of(table, along),
                    axes.sign(axes.around) * numbers_of(table, around),
                ]
            )
        )
    return np.stack(pairs, axis=1)


def counts_of(
    path: object, shear: NDArray[np.float64], scale: float
) -> NDArray[np.int16]:
    """Shear values as whole counts.

    Raises:
        InputError: they are too large.
    """
    counts = np.rint(shear * scale)
    largest = float(np.abs(counts).max(initial=0.0))
    if largest > LARGEST:
        raise InputError(
            f"{path}: shear reaches {largest:.0f} counts, and at most {LARGEST} are "
            "kept; give a smaller --scale"
        )
    return counts.astype(np.int16)
