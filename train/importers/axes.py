"""Taxels of three axes in a table: which columns belong to which axis of which taxel."""

import re
from collections import defaultdict
from dataclasses import dataclass, replace
from typing import Self

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from edge.config import short_text
from edge.errors import InputError
from train.importers.table import Table, numbered

LETTERS = list("xyz")
LAST = re.compile(r"(?P<word>.*?\d)(?P<rest>)[ _.-]*(?P<axis>[xyz])", re.I)
"""A name that ends in its axis, such as s1_x or force2Z."""
FIRST = re.compile(r"(?P<word>[a-z]*?)(?P<axis>[xyz])[ _.-]*(?P<rest>\d.*)", re.I)
"""A name with its axis before its number, such as Fx_1, z12, or x.3 of an array x."""


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
    def of(cls, letters: str | None, flipped: str | None) -> Self | None:
        """The axes of `--axes` and `--flip`; None for one axis.

        Raises:
            InputError: axes are turned round that are not named.
        """
        if letters is not None:
            return cls(letters[0], letters[1], letters[2], flipped or "")
        if flipped:
            raise InputError("--flip needs --axes, such as --axes xyz")
        return None

    def split(self, values: NDArray[np.float64], where: object) -> NDArray[np.float64]:
        """(n, taxels, 3) the normal axis, and those along the rows and around the
        columns, of values (n, ..., 3) of x, y and z.

        Raises:
            InputError: the values of a taxel are not three.
        """
        if values.shape[-1] != 3:
            raise InputError(
                f"{where}: --axes needs values of x, y and z, not {values.shape[1:]}"
            )
        signs = np.where(np.isin(LETTERS, list(self.flipped)), -1.0, 1.0)
        turned = values.reshape(len(values), -1, 3) * signs
        places = map(LETTERS.index, (self.normal, self.along, self.around))
        return turned[..., list(places)]

    @property
    def text(self) -> str:
        """What was taken, in words."""
        turned = f", {' and '.join(self.flipped)} turned round" if self.flipped else ""
        return (
            f"shear: {self.along} along the rows, {self.around} around the columns"
            f"{turned}"
        )


def lettered(name: str) -> tuple[str, str] | None:
    """The letter of a column's axis, and its name without it; None without one."""
    if match := LAST.fullmatch(name) or FIRST.fullmatch(name):
        return match["axis"].lower(), match["word"] + match["rest"]
    return None


def parted(table: Table) -> Table:
    """A table whose taxels have three axes.

    Columns without letters are read three by three, as x, y and z of one taxel after
    another, where the table has no header, or is an array whose last axis has three
    entries.

    Raises:
        InputError: the columns of the axes do not belong together.
    """
    axes = _by_letters(table)
    shape = table.shape
    if axes.empty:
        axes = _three_by_three(table)
        shape = ()
    odd = axes.index[axes.isna().any(axis=1)]
    if len(odd):
        raise InputError(
            f"{table.where}: {short_text(sorted(odd)[:3])} lacks one of the axes x, y, z; "
            "leave --axes out, or fix the names"
        )
    # A magnitude may have the taxel's name.
    magnitudes = axes.index.difference(axes.to_numpy().ravel())
    data = table.data.rename(columns={name: f"{name} norm" for name in magnitudes})
    return replace(table, data=data, shape=shape, file_names=(), axes=axes)


def _by_letters(table: Table) -> pd.DataFrame:
    """The columns whose names have a letter: a row for each taxel, a column for each
    letter."""
    columns: dict[str, dict[str, str]] = defaultdict(dict)
    for name in table.names:
        if match := lettered(name):
            letter, taxel = match
            former = columns[taxel].setdefault(letter, name)
            if former != name:
                raise InputError(
                    f"{table.where}: {former} and {name} are both {letter} of {taxel}; "
                    "rename one of them"
                )
    return pd.DataFrame(columns, index=LETTERS).T


def _three_by_three(table: Table) -> pd.DataFrame:
    """The columns of a table whose values stand in threes, as `_by_letters`.

    Raises:
        InputError: they do not.
    """
    threes = [names for names in table.arrays.values() if len(names) % 3 == 0]
    is_array = table.shape[-1:] == (3,)
    if (table.named and not is_array) or len(threes) != 1:
        raise InputError(
            f"{table.where}: no columns are named by an axis, such as s1_x, s1_y and "
            f"s1_z; it has {short_text(table.names)}"
        )
    names = np.reshape(threes[0], (-1, 3))
    stem = threes[0][0].rpartition(".")[0]
    return pd.DataFrame(names, numbered(stem, len(names)), LETTERS)
