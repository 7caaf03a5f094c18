"""Runs a batch's functions by tape (`tape`), and keeps the state's arrays where tapes find them."""

from __future__ import annotations

from typing import Any

import numpy as np

from train.simulate.arm import Pose
from train.simulate.contact import Array, Springs
from train.simulate.plan import PhysicsFunction
from train.simulate.replay import ROW, replay
from train.simulate.state import State
from train.simulate.tape import NotTaped, Tape, owner

TAPES = 8
"""Ways through the functions that are kept; of more, the least used are forgotten."""


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
        # What was drawn for a trial, nobody sets again.
        self.free = [slot for slot in self.slots if slot.table is not state.values]
        self._number()

    def _settings(self) -> list[Any]:
        """Numbers and the like beside the arrays, of which a tape knows nothing."""
        state = self.state
        return [getattr(state, "image_from", 0), state.bed.lines]

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
            self._load([slot for slot in self.free if slot.table[slot.name] is not slot.last])
        if functions in self.given_up and times == 1 < len(functions):
            for function in functions:
                self.run((function,), 1)
            return
        known = self.tapes.setdefault(functions, [])
        settings = self._settings()
        while times:
            for tape in known:
                if tape.settings != settings:
                    continue
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
                    self._load([s for s in self.free if s.table[s.name] is not s.last])
                    times -= 1

    def _record(self, functions: tuple[PhysicsFunction, ...], known: list[Tape]) -> bool:
        """Record a tape; the state stays as it was."""
        for slot in self.slots:
            if slot.outgrown and not slot.read:
                slot.make_room()
        self._number()
        self._load(self.slots, every=True)
        before = [dict(table) for table in tables(self.state)]
        tape = Tape(self.lasting | self.springs, self._settings())
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
