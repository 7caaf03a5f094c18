"""Runs a batch's frames by tape (`tape`), with the state's arrays where the tapes find them."""

from __future__ import annotations

from typing import Any

import numpy as np

from train.simulate.arm import Pose
from train.simulate.contact import Array, Springs
from train.simulate.plan import PhysicsFunction
from train.simulate.replay import ROW, run_frames
from train.simulate.state import Kept, State
from train.simulate.tape import NotTaped, Tape, owner

Stages = tuple[tuple[tuple[PhysicsFunction, ...], int], ...]
"""The functions of each stage of a frame, and how many times they run in it."""


class Slot:
    """An array of the state, or a few in a tuple or list: `table[name]`, in memory of its own."""

    def __init__(self, table: dict[str, Any], name: str, n: int) -> None:
        """For a batch of n; what is one number for all trials is repeated for each."""
        self.table, self.name = table, name
        value = table[name]
        self.kind = None if isinstance(value, np.ndarray) else type(value)
        arrays = [value] if self.kind is None else list(value)
        self.buffers = [np.zeros(_room(array.shape, n)) for array in arrays]
        for array, buffer in zip(arrays, self.buffers, strict=True):
            buffer[...] = array
        self.plain = all(array.dtype == np.float64 for array in arrays)

    @property
    def arrays(self) -> list[Any]:
        """What is there now."""
        value = self.table[self.name]
        return [value] if self.kind is None else list(value)

    def put(self, arrays: list[Any]) -> None:
        """Let the state hold these."""
        if self.kind is None:
            self.table[self.name] = arrays[0]
        else:
            self.table[self.name] = self.kind(*arrays) if self.kind is Pose else self.kind(arrays)


def _room(shape: tuple[int, ...], n: int) -> tuple[int, ...]:
    return (*shape[:-1], n) if len(shape) > 1 and shape[-1] == 1 else shape


def tables(state: State) -> list[dict[str, Any]]:
    """Where the state keeps its arrays: its own, the bed's, the effects', the values drawn."""
    return [vars(state), vars(state.bed), *(vars(own) for own in state.own.values()), state.values]


class Recorder:
    """Records tapes of a batch's functions, and runs them."""

    def __init__(self, state: State, kept: list[Kept]) -> None:
        """For a batch that has made its first frame: all that a step reads is there.

        Args:
            kept: what is kept of each frame.
        """
        self.state, self.kept = state, kept
        self.slots: list[Slot] = []
        lasting: list[Any] = []
        for table in tables(state):
            for name, value in table.items():
                if isinstance(value, Springs):
                    lasting += [owner(array) for array in value]
                elif isinstance(value, np.ndarray) or (
                    isinstance(value, tuple | list)
                    and value
                    and all(isinstance(one, np.ndarray) for one in value)
                ):
                    self.slots.append(Slot(table, name, state.n))
        lasting += [buffer for slot in self.slots for buffer in slot.buffers]
        self.lasting = {id(array): array for array in lasting}

    def run(self, stages: Stages, first: int, frames: int) -> None:
        """Run the stages of the frames from `first` to `frames` - 1; the state is then as the
        last of them left it.

        Raises:
            NotTaped: a function does what a tape cannot hold.
        """
        times = np.array([count for _, count in stages])
        clock = np.array([first, 0, 0])
        tapes: list[Tape] = []
        code, ways = np.zeros((0, ROW), dtype=np.int64), np.zeros((0, 3), dtype=np.int64)
        while not run_frames(code, ways, times, clock, frames):
            stage = int(clock[1])
            kept = self.kept if stage == len(stages) - 1 else []
            tapes.append(self.record(stages[stage][0], kept))
            begin = len(code)
            code = np.concatenate([code, tapes[-1].code()])
            ways = np.concatenate([[[stage, begin, len(code)]], ways])
        for slot in self.slots:
            if slot.plain:
                slot.put(slot.buffers)

    def record(self, functions: tuple[PhysicsFunction, ...], kept: list[Kept]) -> Tape:
        """A tape of the functions as they run from the state of now, which stays as it is.

        Raises:
            NotTaped: they do what a tape cannot hold.
        """
        tape = Tape(self.lasting)
        before = [dict(table) for table in tables(self.state)]
        begun = {slot: [tape.view(buffer) for buffer in slot.buffers] for slot in self.slots}
        for slot, arrays in begun.items():
            slot.put(arrays)
        try:
            with np.errstate(all="ignore"):  # what is not wanted yet has no numbers
                for function in functions:
                    function(self.state)
                for room, quantity in kept:
                    tape.keep(room, quantity(self.state))
                self._end(tape, before, begun)
        finally:
            for table, kept_table in zip(tables(self.state), before, strict=True):
                table.clear()
                table.update(kept_table)
        return tape

    def _end(self, tape: Tape, before: list[dict[str, Any]], begun: dict[Slot, list[Any]]) -> None:
        """Let the tape end with what has changed put into the state's arrays, all at once."""
        for table, then in zip(tables(self.state), before, strict=True):
            names = {slot.name for slot in self.slots if slot.table is table}
            if any(table[name] is not then.get(name) for name in table.keys() - names):
                raise NotTaped("something else than an array has changed")
        ends: list[tuple[Array, Any]] = []
        for slot, arrays in begun.items():
            for buffer, array, end in zip(slot.buffers, arrays, slot.arrays, strict=True):
                if end is array:
                    continue
                if not slot.plain:
                    raise NotTaped("what is no float has changed")
                # What looks at an array of the state would change with it.
                end = tape.read(end)
                ends.append((buffer, tape.put("copy", (end,)) if tape.lasts(end) else end))
        for buffer, end in ends:
            if np.broadcast_shapes(end.shape, buffer.shape) != buffer.shape:
                raise NotTaped("an array changes its shape")
            tape.emit("copy", buffer.shape, [buffer, end])
