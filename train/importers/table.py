"""Tables whose columns are not yet understood."""

from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from edge.config import short_text
from edge.errors import InputError

EMPTY = "holds no values; leave it out or save it again"


@dataclass(frozen=True)
class Table:
    """The columns of a file, or those of one trial in it.

    Attributes:
        where: names the file, and the trial in it, in errors.
        data: a column for each; columns without a header are named "1", "2" and so on.
            Its index is called `line`, and counts the lines of a text, or `row`.
        name: of the trial, where the file tells it.
        named: the file has a header.
        shape: of the skin, where the file tells it.
        form: how the file was read, where that is worth saying.
        file_names: the names of all columns of the file, in its order, where they are
            not those of `data`.
        units: {column: unit} where the file has a row of them.
        labels: {task: label} that the file tells.
        label: where they stand in it; empty where it tells none.
        axes: columns of taxels of three axes: a row for each taxel, a column for each
            letter; None where a taxel has one column.
    """

    where: str
    data: pd.DataFrame
    name: str = ""
    named: bool = True
    shape: tuple[int, ...] = ()
    form: tuple[str, ...] = ()
    file_names: tuple[str, ...] = ()
    units: Mapping[str, str] = field(default_factory=dict)
    labels: Mapping[str, str] = field(default_factory=dict)
    label: str = ""
    axes: pd.DataFrame | None = None

    def __post_init__(self) -> None:
        if self.data.empty:
            raise InputError(f"{self.where}: {EMPTY}")
        if self.data.index.name is None:
            self.data.index = pd.RangeIndex(1, len(self.data) + 1, name="row")

    @property
    def names(self) -> list[str]:
        """The names of the columns, as they stand, and of taxels of three axes."""
        if self.axes is None:
            return list(self.data.columns)
        plain = self.data.columns.drop(self.axes.to_numpy().ravel())
        return [*self.axes.index, *plain]

    def candidates(self, names: Sequence[str]) -> list[str]:
        """Those of some names that may be taxels."""
        if self.axes is not None:
            return [name for name in names if name in self.axes.index]
        numbers = self.data.select_dtypes(["number", "bool"]).columns
        is_any = self.named or not numbers.size
        return [name for name in names if is_any or name in numbers]

    @property
    def arrays(self) -> dict[str, list[str]]:
        """The columns of each array: names that are alike up to their last dot."""
        arrays: dict[str, list[str]] = defaultdict(list)
        for name in self.names:
            arrays[name.rpartition(".")[0]].append(name)
        return arrays

    def numbers(self, names: Iterable[str]) -> NDArray[np.float64]:
        """(rows, names) the numbers of some columns, as `numbers_of`."""
        return np.column_stack([numbers_of(self, name) for name in names])

    def values(self, names: Sequence[str]) -> NDArray[np.float64]:
        """(rows, taxels) values of some taxels, or (rows, taxels, 3) x, y and z.

        Raises:
            InputError: one of them has one axis alone, or a cell is no number.
        """
        if self.axes is None:
            return self.numbers(names)
        for name in names:
            if name not in self.axes.index:
                raise InputError(f"{self.where}: taxel {name} has one axis alone")
        columns = self.axes.loc[list(names)].to_numpy()
        return self.numbers(columns.ravel()).reshape(-1, *columns.shape)


@contextmanager
def needs(package: str, action: str) -> Iterator[None]:
    """Name the package to install if an import in the block fails.

    Raises:
        InputError: it fails; the sentence begins with the `action`.
    """
    try:
        yield
    except ImportError:
        raise InputError(
            f"{action} needs {package}; install it with `pip install {package}`"
        ) from None


def numbered(stem: str, count: int) -> list[str]:
    """The names of columns without a header, or of those of an array: STEM.1, STEM.2
    and so on."""
    return [f"{stem}.{number}".strip(".") for number in range(1, count + 1)]


def numbers_of(table: Table, name: str) -> pd.Series:
    """A column as numbers; empty cells are NaN.

    Raises:
        InputError: a cell is no number, or one beyond measure.
    """
    column = table.data[name]
    if not pd.api.types.is_numeric_dtype(column):
        column = column.astype(str).str.replace(",", ".")
    numbers = pd.to_numeric(column, errors="coerce").astype("float64")
    numbers = numbers.where(np.isfinite(numbers))
    require_converted(table, name, numbers, "no number")
    return numbers


def require_converted(table: Table, name: str, converted: pd.Series, kind: str) -> None:
    """Refuse a column of which a filled cell could not be converted.

    Raises:
        InputError: there is one; the sentence says that it is of that kind.
    """
    column = table.data[name]
    bad = converted.isna() & column.notna()
    if bad.any():
        cell = short_text(str(column[bad].iloc[0]))
        raise InputError(
            f"{table.where}: {cell} in column {name} is {kind} "
            f"({bad.index.name} {bad.idxmax()})"
        )


def require_unique(names: Iterable[str]) -> None:
    """Refuse a table with two columns of one name.

    Raises:
        InputError: two are named alike.
    """
    for name, count in Counter(names).items():
        if count > 1:
            raise InputError(f"two columns are named {name}; rename one of them")
