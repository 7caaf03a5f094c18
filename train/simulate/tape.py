"""The functions of a step, recorded once as they run on numpy arrays, and replayed from then on.

A batch's step is the same few hundred calls of numpy on the same small arrays, thousands of times,
and nearly all of its time is what a call costs. While functions are recorded, the state's arrays
are `Taped`: each operation on them is carried out, and written on the `Tape` with the addresses
of its arrays. `replay` then runs the tape, compiled, in the same memory. The functions know
nothing of it, and stay the one place where the arithmetic stands.

A branch that asks `mask.any()` is recorded with what it found; where a replay finds something else,
the step is recorded again, as another tape. What a tape cannot hold raises `NotTaped`, and the
functions run as they are.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from train.simulate.arm import Pose
from train.simulate.contact import Array, Springs
from train.simulate.plan import PhysicsFunction
from train.simulate.replay import CODE, ROW, replay
from train.simulate.state import State

TAPES = 8
"""Ways through the functions that are kept; more, and they run as they are."""
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

    def __array_finalize__(self, other: Any) -> None:
        """A view is on the same tape."""
        self.tape = getattr(other, "tape", None)  # type: ignore[assignment]

    def __array_ufunc__(self, ufunc: Any, method: str, *inputs: Any, **how: Any) -> Any:
        """Carry out and record."""
        name = SAME.get(ufunc.__name__, ufunc.__name__)
        out = how.pop("out", (None,))[0]
        if method == "__call__" and not how and name in CODE:
            return self.tape.put(name, inputs, out)
        axis = how.get("axis", 0)
        if name == "logical_or" and method == "reduce" and (axis is None or self.ndim == 1):
            return Some(self.tape, inputs[0])
        plain = out is None and not how.get("keepdims") and how.get("where", True) is True
        if axis != 0 or not plain or name not in ("add", "maximum", "minimum"):
            raise NotTaped(f"{name}.{method}")
        return self.tape.along(name, inputs[0], running=method == "accumulate")

    def __array_function__(self, function: Any, kinds: Any, args: Any, how: Any) -> Any:
        """Carry out and record; views need no record."""
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
        """Record what is put where."""
        self.tape.put("copy", (value,), self[key])

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
        used: ids of those that an operation reads.
        rows: see `replay`; the first `caught_up` of them have been carried out.
        changed: what the tape leaves changed.
    """

    lasting: dict[int, Any]
    known: dict[int, Any] = field(default_factory=dict)
    used: set[int] = field(default_factory=set)
    numbers: dict[tuple[float, int], Array] = field(default_factory=dict)
    rows: list[list[int]] = field(default_factory=list)
    caught_up: int = 0
    code: NDArray[np.int64] = field(init=False)
    changed: list[Slot] = field(default_factory=list)

    def view(self, array: Array) -> Taped:
        """The array, on this tape."""
        taped = array.view(Taped)
        taped.tape = self
        return taped

    def new(self, shape: tuple[int, ...]) -> Taped:
        """Room for a result."""
        array = np.empty(shape)
        self.known[id(array)] = array
        return self.view(array)

    def read(self, value: Any, inner: int = 1) -> Any:
        """An operand as an array of known memory; a number is repeated `inner` times.

        Raises:
            NotTaped: an array that came about beside the tape.
        """
        if not getattr(value, "shape", ()):
            key = (float(value), inner)
            if key not in self.numbers:
                self.numbers[key] = np.full(inner, key[0])
                self.known[id(self.numbers[key])] = self.numbers[key]
            return self.numbers[key]
        own = id(owner(value))
        if own not in self.known and own not in self.lasting:
            raise NotTaped("an array from elsewhere")
        self.used.add(own)
        return value

    def put(self, name: str, inputs: tuple[Any, ...], out: Any = None) -> Taped:
        """Record one operation."""
        if out is None:
            out = self.new(np.broadcast_shapes(*(getattr(x, "shape", ()) for x in inputs)))
        elif id(owner(out)) in self.lasting:
            raise NotTaped("an array of the state is changed in place")
        inner = out.shape[-1] if out.ndim else 1
        operands = [self.read(value, inner) for value in inputs]
        for i, array in enumerate(operands):
            scattered = array.strides[-1] != 8 or array.shape[-1] != inner
            if name != "copy" and inner > 1 and scattered:
                operands[i] = self.put("copy", (array,), self.new((*array.shape[:-1], inner)))
        self.emit(name, out.shape, [out, *operands])
        return out if isinstance(out, Taped) else self.view(out)

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
        lengths, strides = list(shape), []
        for array in arrays:
            own = [0 if d == 1 else s for d, s in zip(array.shape, array.strides, strict=True)]
            strides.append([0] * (len(shape) - len(own)) + own)
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
        addresses = [array.__array_interface__["data"][0] for array in arrays]
        unused = 4 - len(arrays)
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
            row[: 1 + array.ndim] = (array.__array_interface__["data"][0], *array.shape)
        self.known[id(table)] = table
        address = table.__array_interface__["data"][0]
        self.rows.append([CODE["call"], function.address, address, *[0] * (ROW - 3)])
        return results

    def catch_up(self) -> None:
        """Carry out what has been recorded, for a branch that wants to know."""
        if self.caught_up < len(self.rows):
            replay(np.array(self.rows[self.caught_up :], dtype=np.int64), 1)
            self.caught_up = len(self.rows)


class Slot:
    """An array of the state, or a few in a tuple or list: `table[name]`, with room of our own."""

    def __init__(self, table: dict[str, Any], name: str, n: int) -> None:
        """For a batch of n."""
        self.table, self.name, self.n = table, name, n
        value = table[name]
        self.kind = None if isinstance(value, np.ndarray) else type(value)
        self.last: Any = None
        self.read = False
        self.make_room()

    @property
    def arrays(self) -> list[Any]:
        """What is there now."""
        value = self.table[self.name]
        return [value] if self.kind is None else list(value)

    def make_room(self) -> None:
        """Of the same shapes; what is one number for all trials is repeated for each."""
        self.buffers = [np.zeros(self.room(array)) for array in self.arrays]
        self.own = self.pack(self.buffers)
        self.plain = all(array.dtype == np.float64 for array in self.arrays)

    def room(self, array: Array) -> tuple[int, ...]:
        """The shape of an array's room."""
        shape = array.shape
        return (*shape[:-1], self.n) if len(shape) > 1 and shape[-1] == 1 else shape

    @property
    def outgrown(self) -> bool:
        """What is there now has no place in our room."""
        pairs = zip(self.arrays, self.buffers, strict=True)
        return self.table[self.name] is not self.own and any(
            self.room(array) != buffer.shape for array, buffer in pairs
        )

    def grow(self, i: int, shape: tuple[int, ...]) -> None:
        """Room of another shape, which no tape may know yet.

        Raises:
            NotTaped: one does.
        """
        if self.read:
            raise NotTaped("an array that others read changes its shape")
        self.buffers[i] = np.zeros(shape)
        self.own = self.pack(self.buffers)

    def pack(self, arrays: list[Any]) -> Any:
        """Arrays in the form in which the state holds them."""
        if self.kind is None:
            return arrays[0]
        return self.kind(*arrays) if self.kind is Pose else self.kind(arrays)

    def load(self, arrays: list[Any]) -> None:
        """Take arrays into our room, and let the state hold that."""
        for array, buffer in zip(arrays, self.buffers, strict=True):
            if array is not buffer:
                buffer[...] = array
        self.show()

    def show(self) -> None:
        """Let the state hold our room."""
        if self.plain:
            self.table[self.name] = self.own
        self.last = self.table[self.name]


def tables(state: State) -> list[dict[str, Any]]:
    """Where the state keeps its arrays: its own, the bed's, the effects', the values drawn."""
    return [vars(state), vars(state.bed), *(vars(own) for own in state.own.values()), state.values]


class Recorder:
    """Runs functions on a state, by tape where it can."""

    def __init__(self, state: State) -> None:
        """For a batch that has made its first frame: all that a step reads is there."""
        self.state = state
        self.slots: list[Slot] = []
        self.springs: dict[int, Any] = {}
        self.tapes: dict[tuple[PhysicsFunction, ...], list[Tape]] = {}
        self.given_up: set[tuple[PhysicsFunction, ...]] = set()
        self.away: set[Slot] = set()
        for table in tables(state):
            for name, value in table.items():
                if isinstance(value, Springs):
                    self.springs |= {id(owner(array)): owner(array) for array in value}
                elif isinstance(value, np.ndarray) or (
                    isinstance(value, tuple | list)
                    and value
                    and all(isinstance(one, np.ndarray) for one in value)
                ):
                    self.slots.append(Slot(table, name, state.n))
        self._number()

    def _number(self) -> None:
        buffers = [buffer for slot in self.slots for buffer in slot.buffers]
        self.lasting = {id(buffer): buffer for buffer in buffers}

    def _load(self, slots: list[Slot], every: bool = False) -> None:
        """Take what the functions between two tapes have put into the state, as far as a tape
        reads it. What looks at another's room is copied first: a tape would change it."""
        given = []
        for slot in slots:
            arrays = slot.arrays
            shared = False
            for i, array in enumerate(arrays):
                if array is not slot.buffers[i] and id(owner(array)) in self.lasting:
                    arrays[i], shared = np.array(array), True
            given.append((slot, arrays, shared))
        for slot, arrays, shared in given:
            if shared:
                slot.table[slot.name] = slot.pack(arrays)
            if every or slot.read:
                if slot.outgrown:
                    self._give_up(slot)
                slot.load(arrays)
            else:
                self.away.add(slot)
            slot.last = slot.table[slot.name]

    def _give_up(self, slot: Slot) -> None:
        """Who reads an array that changes its shape runs as it is; the others are recorded anew."""
        ids = {id(buffer) for buffer in slot.buffers}
        for functions, known in self.tapes.items():
            if any(ids & tape.used for tape in known):
                self.given_up.add(functions)
        self.tapes.clear()
        slot.read = False
        slot.make_room()
        self._number()

    def run(self, functions: tuple[PhysicsFunction, ...], times: int, changed: bool = True) -> None:
        """Run the functions so many times; `changed` is False right after another run."""
        if changed:
            self._load([slot for slot in self.slots if slot.table[slot.name] is not slot.last])
        if functions in self.given_up and times == 1 < len(functions):
            for function in functions:
                self.run((function,), 1)
            return
        known = self.tapes.setdefault(functions, [])
        while times:
            for tape in known:
                done = replay(tape.code, times)
                if done:
                    for slot in self.away.intersection(tape.changed):
                        self.away.discard(slot)
                        slot.show()
                    known.remove(tape)
                    known.insert(0, tape)
                    times -= done
                    break
            else:
                if functions in self.given_up or not self._record(functions, known):
                    for function in functions:
                        function(self.state)
                    self._load([s for s in self.slots if s.table[s.name] is not s.last])
                    times -= 1

    def _record(self, functions: tuple[PhysicsFunction, ...], known: list[Tape]) -> bool:
        """Record a tape; the state stays as it was."""
        for slot in self.slots:
            if slot.outgrown and not slot.read:
                slot.make_room()
        self._number()
        self._load(self.slots, every=True)
        before = [dict(table) for table in tables(self.state)]
        tape = Tape(self.lasting | self.springs)
        begun = {}
        for slot in self.slots:
            begun[slot] = [tape.view(buffer) for buffer in slot.buffers]
            slot.table[slot.name] = slot.pack(begun[slot])
        try:
            with np.errstate(all="ignore"):  # what is not wanted yet has no numbers
                for function in functions:
                    function(self.state)
            self._end(tape, before, begun)
        except (NotTaped, IndexError):  # a taped array is no index
            self.given_up.add(functions)
            return False
        finally:
            for table, kept in zip(tables(self.state), before, strict=True):
                table.clear()
                table.update(kept)
            for slot in self.slots:
                slot.read = slot.read or any(id(buffer) in tape.used for buffer in slot.buffers)
        if len(known) == TAPES:
            known.pop()
        known.insert(0, tape)
        return True

    def _end(self, tape: Tape, before: list[dict[str, Any]], begun: dict[Slot, list[Any]]) -> None:
        """Let the tape end with what has changed put into the state's arrays, all at once."""
        for table, kept in zip(tables(self.state), before, strict=True):
            names = {slot.name for slot in self.slots if slot.table is table}
            for name in table.keys() - names:
                now, then = table[name], kept.get(name)
                if now is not then and not (isinstance(now, int | slice) and now == then):
                    raise NotTaped("something else than an array has changed")
        ends: list[tuple[Slot, int, Any]] = []
        for slot, arrays in begun.items():
            ended = slot.arrays
            if all(end is array for end, array in zip(ended, arrays, strict=True)):
                continue
            if not slot.plain:
                raise NotTaped("what is true or false has changed")
            tape.changed.append(slot)
            for i, end in enumerate(ended):
                if end is arrays[i]:
                    continue
                end = tape.read(end)
                if id(owner(end)) in self.lasting:
                    end = tape.put("copy", (end,))
                ends.append((slot, i, end))
        for slot, i, end in ends:
            if end.size > slot.buffers[i].size:
                slot.grow(i, end.shape)
                self.away.add(slot)
            if np.broadcast_shapes(end.shape, slot.buffers[i].shape) != slot.buffers[i].shape:
                raise NotTaped("an array changes its shape")
            tape.emit("copy", slot.buffers[i].shape, [slot.buffers[i], end])
        for slot in tape.changed:
            if slot.kind is not None:
                # What the tape leaves alone of a few arrays is put back with the others.
                tape.used |= {id(buffer) for buffer in slot.buffers}
        self._number()
        tape.code = np.array(tape.rows, dtype=np.int64).reshape(-1, ROW)
