"""Runs a tape (`tape`): rows of whole numbers, each an operation on arrays in memory, compiled.

numpy takes about a microsecond a call, however short its arrays; here a call takes some
nanoseconds. The arithmetic is the same, in the same order.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from llvmlite import ir
from numba import njit, types
from numba.extending import intrinsic
from numpy.typing import NDArray

OPERATIONS = (
    *("copy", "negative", "absolute", "sqrt", "exp", "sin", "cos", "floor", "rint"),
    "logical_not",
    *("add", "subtract", "multiply", "divide", "maximum", "minimum"),
    *("greater", "greater_equal", "less", "less_equal", "logical_and", "logical_or"),
    *("where", "clip", "gather", "at", "any", "call", "keep"),
)
CODE = {name: i for i, name in enumerate(OPERATIONS)}
COPY, NEGATIVE, ABSOLUTE, SQRT, EXP, SIN, COS, FLOOR, RINT, NOT = range(10)
ADD, SUBTRACT, MULTIPLY, DIVIDE, MAXIMUM, MINIMUM = range(10, 16)
GREATER, GREATER_EQUAL, LESS, LESS_EQUAL, AND, OR = range(16, 22)
WHERE, CLIP, GATHER, AT, ANY, CALL, KEEP = range(22, 29)
ROW = 19
"""Numbers of a row: the operation; the addresses of the result and of three operands; three
lengths; the strides in bytes of the outer two dimensions of each; the inner strides, in numbers,
of a copy's result and operand; what `any` has to find. See `keep` for its own."""
KINDS = ("float64", "float32", "uint16")
"""Of numbers that are kept."""


def _at(typingctx: Any, address: Any, kind: Any) -> Any:
    """What lies at an address: numbers of a kind."""

    def code(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        return builder.inttoptr(args[0], context.get_value_type(signature.return_type))

    return types.CPointer(kind.dtype)(types.int64, kind), code


def _call(typingctx: Any, function: Any, table: Any) -> Any:
    """Call the function at one address with another, of the table of its arguments."""

    def code(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        word = ir.IntType(64)
        kind = ir.FunctionType(ir.VoidType(), [word.as_pointer()])
        target = builder.inttoptr(args[0], kind.as_pointer())
        builder.call(target, [builder.inttoptr(args[1], word.as_pointer())])
        return context.get_dummy_value()

    return types.void(types.int64, types.int64), code


at: Any = intrinsic(_at)
call: Any = intrinsic(_call)


@njit(error_model="numpy")
def floats(address: int) -> Any:
    """The floats at an address."""
    return at(address, types.float64)


@njit(error_model="numpy")
def one(op: int, o: Any, a: Any, n: int) -> None:
    """n results of an operation on one number each."""
    if op == COPY:
        for k in range(n):
            o[k] = a[k]
    elif op == NEGATIVE:
        for k in range(n):
            o[k] = -a[k]
    elif op == ABSOLUTE:
        for k in range(n):
            o[k] = abs(a[k])
    elif op == SQRT:
        for k in range(n):
            o[k] = math.sqrt(a[k])
    elif op == EXP:
        for k in range(n):
            o[k] = math.exp(a[k])
    elif op == SIN:
        for k in range(n):
            o[k] = math.sin(a[k])
    elif op == COS:
        for k in range(n):
            o[k] = math.cos(a[k])
    elif op == FLOOR:
        for k in range(n):
            o[k] = math.floor(a[k])
    elif op == RINT:
        for k in range(n):
            o[k] = np.rint(a[k])
    else:
        for k in range(n):
            o[k] = 1.0 if a[k] == 0.0 else 0.0


@njit(error_model="numpy")
def two(op: int, o: Any, a: Any, b: Any, n: int) -> None:
    """n results of an operation on two numbers each; what is true is 1."""
    if op == ADD:
        for k in range(n):
            o[k] = a[k] + b[k]
    elif op == SUBTRACT:
        for k in range(n):
            o[k] = a[k] - b[k]
    elif op == MULTIPLY:
        for k in range(n):
            o[k] = a[k] * b[k]
    elif op == DIVIDE:
        for k in range(n):
            o[k] = a[k] / b[k]
    elif op == MAXIMUM:
        for k in range(n):
            o[k] = a[k] if a[k] >= b[k] or a[k] != a[k] else b[k]
    elif op == MINIMUM:
        for k in range(n):
            o[k] = a[k] if a[k] <= b[k] or a[k] != a[k] else b[k]
    elif op == GREATER:
        for k in range(n):
            o[k] = 1.0 if a[k] > b[k] else 0.0
    elif op == GREATER_EQUAL:
        for k in range(n):
            o[k] = 1.0 if a[k] >= b[k] else 0.0
    elif op == LESS:
        for k in range(n):
            o[k] = 1.0 if a[k] < b[k] else 0.0
    elif op == LESS_EQUAL:
        for k in range(n):
            o[k] = 1.0 if a[k] <= b[k] else 0.0
    elif op == AND:
        for k in range(n):
            o[k] = 1.0 if a[k] != 0.0 and b[k] != 0.0 else 0.0
    else:
        for k in range(n):
            o[k] = 1.0 if a[k] != 0.0 or b[k] != 0.0 else 0.0


@njit(error_model="numpy")
def three(op: int, o: Any, a: Any, b: Any, c: Any, n: int) -> None:
    """n results of an operation on three numbers each."""
    if op == WHERE:
        for k in range(n):
            o[k] = b[k] if a[k] != 0.0 else c[k]
    else:
        for k in range(n):
            low = a[k] if a[k] > b[k] or a[k] != a[k] else b[k]
            o[k] = low if low < c[k] or low != low else c[k]


@njit(error_model="numpy")
def rare(row: NDArray[Any]) -> bool:
    """Copies of what is scattered; picks by number (`np.take_along_axis`, first axis); sums by
    number (`np.add.at`, of a flat array)."""
    op = row[0]
    for i in range(row[5]):
        for j in range(row[6]):
            o = floats(row[1] + (0 if op == AT else i * row[8] + j * row[9]))
            a = floats(row[2] + i * row[10] + j * row[11])
            if op == COPY:
                for k in range(row[7]):
                    o[k * row[16]] = a[k * row[17]]
                continue
            index = floats(row[3] + i * row[12] + j * row[13])
            for k in range(row[7]):
                if op == AT:
                    o[int(index[k])] += a[k]
                else:
                    o[k] = floats(row[2] + i * row[10] + int(index[k]) * row[11])[k]
    return True


@njit(error_model="numpy")
def found(row: NDArray[Any]) -> bool:
    """Whether any of an array's numbers is not 0."""
    for i in range(row[5]):
        for j in range(row[6]):
            a = floats(row[2] + i * row[10] + j * row[11])
            for k in range(row[7]):
                if a[k] != 0.0:
                    return True
    return False


@njit(error_model="numpy")
def keep(row: NDArray[Any], frame: int) -> None:
    """Put an array where a frame's is kept. Of the row: the operation; the addresses of the first
    frame's and of the array; bytes from frame to frame; the kind; three lengths; the strides in
    bytes of the result and of the array."""
    for i in range(row[5]):
        for j in range(row[6]):
            o = row[1] + frame * row[3] + i * row[8] + j * row[9]
            a = floats(row[2] + i * row[11] + j * row[12])
            step = row[13] // 8
            if row[4] == 0:
                for k in range(row[7]):
                    floats(o + k * row[10])[0] = a[k * step]
            elif row[4] == 1:
                for k in range(row[7]):
                    at(o + k * row[10], types.float32)[0] = a[k * step]
            else:
                for k in range(row[7]):
                    at(o + k * row[10], types.uint16)[0] = a[k * step]


@njit(error_model="numpy")
def play(code: NDArray[Any], first: int, last: int, frame: int) -> bool:
    """Run the rows from `first` to `last` - 1 of a code (rows, ROW).

    Returns:
        False where an `any` finds what it did not when the tape was recorded; no lasting array
        has then been written.
    """
    for r in range(first, last):
        row = code[r]
        op = row[0]
        if op == ANY:
            if found(row) != (row[18] != 0):
                return False
        elif op == CALL:
            call(row[1], row[2])
        elif op == KEEP:
            keep(row, frame)
        elif op in (GATHER, AT) or row[16] != 1 or row[17] != 1:
            rare(row)
        else:
            o, a, b, c, n = row[1], row[2], row[3], row[4], row[7]
            for i in range(row[5]):
                for j in range(row[6]):
                    o_, a_ = (
                        floats(o + i * row[8] + j * row[9]),
                        floats(a + i * row[10] + j * row[11]),
                    )
                    if op < ADD:
                        one(op, o_, a_, n)
                        continue
                    b_ = floats(b + i * row[12] + j * row[13])
                    if op < WHERE:
                        two(op, o_, a_, b_, n)
                    else:
                        three(op, o_, a_, b_, floats(c + i * row[14] + j * row[15]), n)
    return True


@njit(cache=True, error_model="numpy")
def run_frames(
    code: NDArray[Any], ways: NDArray[Any], times: NDArray[Any], clock: NDArray[Any], frames: int
) -> bool:
    """Run frames by tape until all have run, or none of a stage's tapes runs to its end.

    Args:
        code: (rows, ROW) of all tapes.
        ways: (tapes, 3) the stage of each, its first row and its last + 1; of a stage's, the one
            that ran last is put first.
        times: (stages,) how often each runs in a frame.
        clock: (3,) the frame, the stage, and how often that has run; moves on.
        frames: the frame to stop at.

    Returns:
        Whether all frames have run.
    """
    while clock[0] < frames:
        while clock[1] < len(times):
            while clock[2] < times[clock[1]]:
                ran = False
                front = -1
                for i in range(len(ways)):
                    if ways[i, 0] != clock[1]:
                        continue
                    front = i if front < 0 else front
                    if play(code, ways[i, 1], ways[i, 2], clock[0]):
                        for j in range(3):
                            ways[front, j], ways[i, j] = ways[i, j], ways[front, j]
                        ran = True
                        break
                if not ran:
                    return False
                clock[2] += 1
            clock[1] += 1
            clock[2] = 0
        clock[0] += 1
        clock[1] = 0
    return True


def replay(code: NDArray[Any]) -> bool:
    """Run one tape (rows, ROW) once; False where it did not run to its end (`play`)."""
    ways, once, clock = np.array([[0, 0, len(code)]]), np.array([1]), np.array([0, 0, 0])
    return bool(run_frames(code, ways, once, clock, 1))
