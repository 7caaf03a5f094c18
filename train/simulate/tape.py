"""The functions of a step, recorded once as they run on numpy arrays, and replayed from then on.

A batch's step is the same few hundred calls of numpy on the same small arrays, thousands of times,
and nearly all of its time is what a call costs. While functions are recorded, the state's arrays
are `Taped`: each operation on them is written on the `Tape` with the addresses of its arrays.
`replay` then runs the tape, compiled, in the same memory. The functions know nothing of it, and
stay the one place where the arithmetic stands.

A branch that asks `mask.any()` is recorded with what it found; where a replay finds something else,
the step is recorded again, as another tape. What a tape cannot hold raises `NotTaped`.
"""

from __future__ import annotations

import ctypes
import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from train.simulate.contact import Array
from train.simulate.replay import CODE, KINDS, ROW, replay

SAME = {
    "true_divide": "divide",
    "bitwise_and": "logical_and",
    "bitwise_or": "logical_or",
    "invert": "logical_not",
}
VIEWS = ("broadcast_to", "moveaxis", "transpose", "swapaxes", "expand_dims", "reshape", "clip")


class NotTaped(Exception):
    """Something that a tape cannot hold."""


class Taped(np.ndarray[Any, Any]):
    """An array whose operations are written on a tape; what is true or false in it is 1 or 0."""

    tape: Tape
    """Each tape's arrays, and the views of them, have a class of their own."""

    def __array_ufunc__(self, ufunc: Any, method: str, *inputs: Any, **how: Any) -> Any:
        """Record."""
        name = SAME.get(ufunc.__name__, ufunc.__name__)
        out = how.pop("out", (None,))[0]
        if method == "__call__" and not how and name in CODE:
            return self.tape.put(name, inputs, out)
        if method == "at" and name == "add" and inputs[0].ndim == 1:
            self.tape.put_at(*inputs)
            return None
        axis = how.get("axis", 0)
        if name == "logical_or" and method == "reduce" and (axis is None or self.ndim == 1):
            return Some(self.tape, inputs[0])
        plain = out is None and not how.get("keepdims") and how.get("where", True) is True
        if axis is None or not plain or name not in ("add", "maximum", "minimum"):
            raise NotTaped(f"{name}.{method}")
        running = method == "accumulate"
        along = self.tape.along(name, np.moveaxis(inputs[0], axis, 0), running)
        return np.moveaxis(along, 0, axis) if running else along

    def __array_function__(self, function: Any, kinds: Any, args: Any, how: Any) -> Any:
        """Record; views need no record."""
        name = function.__name__
        if name == "where" and len(args) == 3:
            return self.tape.put("where", args)
        if name == "broadcast_to":
            return self.tape.view(np.broadcast_to(np.asarray(args[0]), *args[1:], **how))
        if name in VIEWS:
            return super().__array_function__(function, (Taped,), args, how)
        if name in ("zeros_like", "empty_like"):
            out = self.tape.new(how.get("shape", args[0].shape))
            return out if name == "empty_like" else self.tape.put("copy", (0.0,), out)
        if name == "stack":
            parts, axis = args[0], how.get("axis", 0)
            shape = list(parts[0].shape)
            shape.insert(axis, len(parts))
            whole = np.moveaxis(self.tape.new(tuple(shape)), axis, 0)
            for place, part in zip(whole, parts, strict=True):
                self.tape.put("copy", (part,), place)
            return np.moveaxis(whole, 0, axis)
        if name == "copy":
            return self.tape.put("copy", (self,))
        if name == "take_along_axis" and (args[2:] or (how.get("axis"),))[0] == 0:
            return self.tape.put("gather", args[:2])
        raise NotTaped(name)

    def __getitem__(self, key: Any) -> Any:
        """A view; a single number would be one of this step only."""
        found = super().__getitem__(key)
        if not isinstance(found, Taped):
            raise NotTaped("a single number")
        return found

    def __iter__(self) -> Iterator[Any]:
        """Views, row by row."""
        return (self[i] for i in range(len(self)))

    def __setitem__(self, key: Any, value: Any) -> None:
        """Record what is put where; `x[key] += 1` puts what is there already."""
        place = self[key]
        if not (isinstance(value, Taped) and _same(place, value)):
            self.tape.put("copy", (value,), place)

    def astype(self, *kind: Any, **how: Any) -> Any:
        """On a tape whole numbers are floats too."""
        return self

    def __bool__(self) -> bool:
        """Only `any` can be asked."""
        raise NotTaped("bool")

    __float__ = __int__ = __index__ = item = tolist = __bool__  # type: ignore[assignment]


@dataclass(frozen=True)
class Some:
    """Whether any number of an array is not 0: what a branch asks."""

    tape: Tape
    array: Taped

    def __bool__(self) -> bool:
        """What it is now; a replay that finds something else ends."""
        self.tape.catch_up()
        found = bool(np.asarray(self.array).any())
        self.tape.emit("any", self.array.shape, [self.array, self.array], expected=found)
        return found


def _same(one: Any, other: Any) -> bool:
    """Both look at the same memory in the same way."""
    return (one.strides, address(one)) == (other.strides, address(other))


def address(array: Any) -> int:
    """Of an array's first number: what follows the object's head in numpy's `PyArrayObject`.

    `__array_interface__` says the same in thirty times the time, half of what a recording took.
    """
    return ctypes.c_size_t.from_address(id(array) + object.__basicsize__).value


def _strides(array: Any, dimensions: int) -> list[int]:
    """Bytes from one number to the next along each dimension of a wider shape."""
    own = [0 if d == 1 else s for d, s in zip(array.shape, array.strides, strict=True)]
    return [0] * (dimensions - len(own)) + own


def owner(array: Any) -> Any:
    """The array whose memory this one looks at."""
    while isinstance(array.base, np.ndarray):
        array = array.base
    return array


@dataclass
class Tape:
    """A record of operations.

    Attributes:
        lasting: {id: array} of the state's arrays; only the tape's end writes them.
        known: {id: array} of all other arrays with an address on the tape.
        rows: see `replay`; the first `caught_up` of them have been carried out.
    """

    lasting: dict[int, Any]
    known: dict[int, Any] = field(default_factory=dict)
    numbers: dict[tuple[float, tuple[int, ...]], Array] = field(default_factory=dict)
    rows: list[list[int]] = field(default_factory=list)
    caught_up: int = 0

    def __post_init__(self) -> None:
        """Its arrays' class."""
        self.kind = type("Taped", (Taped,), {"tape": self})

    def view(self, array: Array) -> Taped:
        """The array, on this tape."""
        return cast(Taped, array.view(self.kind))

    def new(self, shape: tuple[int, ...]) -> Taped:
        """Room for a result."""
        array = np.empty(shape)
        self.known[id(array)] = array
        return self.view(array)

    def read(self, value: Any, shape: tuple[int, ...] = (1,)) -> Any:
        """An operand as an array of known memory; a number is repeated in a shape.

        Raises:
            NotTaped: an array that came about beside the tape.
        """
        if not getattr(value, "shape", ()):
            key = (float(value), shape)
            if key not in self.numbers:
                self.numbers[key] = np.full(shape, key[0])
                self.known[id(self.numbers[key])] = self.numbers[key]
            return self.numbers[key]
        own = id(owner(value))
        if own not in self.known and own not in self.lasting:
            raise NotTaped("an array from elsewhere")
        return value

    def lasts(self, array: Any) -> bool:
        """It looks at an array of the state."""
        return id(owner(array)) in self.lasting

    def put(self, name: str, inputs: tuple[Any, ...], out: Any = None) -> Taped:
        """Record one operation."""
        if out is None:
            shapes = {getattr(x, "shape", ()) for x in inputs} - {()}
            out = self.new(shapes.pop() if len(shapes) == 1 else np.broadcast_shapes(*shapes))
        elif self.lasts(out):
            raise NotTaped("an array of the state is changed in place")
        inner = out.shape[-1] if out.ndim else 1
        # Where all else lies in one piece, so does a number.
        arrays = [out, *(x for x in inputs if getattr(x, "shape", ()))]
        flat = out.ndim and all(x.shape == out.shape and x.flags.c_contiguous for x in arrays)
        operands = [self.read(value, out.shape if flat else (inner,)) for value in inputs]
        for i, array in enumerate(operands):
            scattered = array.strides[-1] != 8 or array.shape[-1] != inner
            if name != "copy" and inner > 1 and scattered:
                operands[i] = self.put("copy", (array,), self.new((*array.shape[:-1], inner)))
        self.emit(name, out.shape, [out, *operands])
        return out if isinstance(out, Taped) else self.view(out)

    def put_at(self, out: Any, index: Any, values: Any) -> None:
        """Record the sums by number of a flat array.

        Raises:
            NotTaped: it is the state's.
        """
        if self.lasts(out):
            raise NotTaped("an array of the state is changed in place")
        shape = np.broadcast_shapes(index.shape, values.shape)
        operands = [self.put("copy", (x,), self.new(shape)) for x in (values, index)]
        addresses = [address(array) for array in (out, *operands)]
        row = [CODE["at"], *addresses, 0, 1, 1, math.prod(shape)]
        self.rows.append([*row, *[0] * (ROW - len(row))])

    def keep(self, room: Any, value: Any) -> None:
        """Record that the value is kept as a frame's: in room[frame], of any of some kinds."""
        first = room[0]
        value = np.broadcast_to(self.read(value), first.shape)
        pad = 3 - first.ndim
        lengths = [*[1] * pad, *first.shape]
        strides = [x for array in (first, value) for x in (*[0] * pad, *array.strides)]
        kind = KINDS.index(room.dtype.name)
        row = [CODE["keep"], address(room), address(value), room.strides[0], kind]
        self.rows.append([*row, *lengths, *strides, *[0] * (ROW - 14)])

    def along(self, name: str, values: Taped, running: bool) -> Taped:
        """Reduce or accumulate along the first axis, one after the other."""
        out = self.new(values.shape if running else values.shape[1:])
        into = out if running else out[None]
        self.put("copy", (values[:1],), into[:1])
        if running or values[0].size == 1:
            for i in range(1, len(values)):
                last, now = (out[i - 1 : i], out[i : i + 1]) if running else (into, into)
                self.put(name, (last, values[i : i + 1]), now)
        elif len(values) > 1:
            rest = self.read(values[1:])
            if rest.strides[-1] != 8:
                rest = self.put("copy", (rest,))
            whole = np.broadcast_to(np.asarray(into), rest.shape)
            self.emit(name, rest.shape, [whole, whole, rest])
        return out

    def emit(
        self, name: str, shape: tuple[int, ...], arrays: list[Any], expected: bool = False
    ) -> None:
        """Write an operation's row; dimensions that lie one after the other become one."""
        if 0 in shape:
            return
        addresses, unused = [address(array) for array in arrays], 4 - len(arrays)
        plain = all(array.shape == shape and array.flags.c_contiguous for array in arrays)
        if plain and name != "gather":
            row = [CODE[name], *addresses, *[0] * unused, 1, 1, math.prod(shape), *[0] * 8]
            self.rows.append([*row, 1, 1, int(expected)])
            return
        strides = [_strides(array, len(shape)) for array in arrays]
        lengths = list(shape)
        for i in reversed(range(len(shape) - 1)):
            joined = all(s[i] == s[i + 1] * lengths[i + 1] for s in strides)
            if (lengths[i] == 1 or joined) and name != "gather":
                lengths[i : i + 2] = [lengths[i] * lengths[i + 1]]
                for s in strides:
                    del s[i]
        pad = 3 - len(lengths)
        if pad < (1 if name == "gather" else 0):
            raise NotTaped("too many dimensions")
        lengths = [1] * pad + lengths
        strides = [[0] * pad + s for s in strides]
        inner = [s[2] // 8 if lengths[2] > 1 else 1 for s in strides]
        if name != "copy" and any(s != 1 for s in inner):
            raise NotTaped("numbers that do not lie side by side")
        outer = [x for s in strides for x in s[:2]] + [0, 0] * unused
        row = [CODE[name], *addresses, *[0] * unused, *lengths, *outer]
        self.rows.append([*row, *[*inner, 1][:2], int(expected)])

    def call(
        self, function: Any, arrays: tuple[Any, ...], shapes: tuple[tuple[int, ...], ...]
    ) -> tuple[Taped, ...]:
        """Record the call of a compiled function (a `cfunc`): it takes the address of a table,
        which has for each array and each result its address and its lengths."""
        results = tuple(self.new(shape) for shape in shapes)
        table = np.zeros((len(arrays) + len(results), 4), dtype=np.int64)
        for row, array in zip(table, (*arrays, *results), strict=True):
            if not array.flags.c_contiguous:
                raise NotTaped("an array with gaps")
            if array.size:
                self.read(array)
            row[: 1 + array.ndim] = (address(array), *array.shape)
        self.known[id(table)] = table
        self.rows.append([CODE["call"], function.address, address(table), *[0] * (ROW - 3)])
        return results

    def code(self, first: int = 0) -> NDArray[np.int64]:
        """(rows, ROW) the rows from `first` on."""
        return np.array(self.rows[first:], dtype=np.int64).reshape(-1, ROW)

    def catch_up(self) -> None:
        """Carry out what has been recorded, for a branch that wants to know."""
        replay(self.code(self.caught_up))
        self.caught_up = len(self.rows)
