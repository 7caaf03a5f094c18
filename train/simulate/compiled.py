"""What runs a trial, compiled: functions of one trial's record, called by their addresses.

numpy takes about a microsecond a call, however short its arrays, and a step is some hundred calls
on numbers; so the physics' functions are compiled by numba, each on its own, and a plan is a list
of their addresses. An effect that is not called for is neither loaded nor compiled.

A record holds a trial's numbers. What has another length in each scene (rows, columns) lies
elsewhere, and the record holds its address.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from llvmlite import ir
from numba import cfunc, from_dtype, njit, types
from numba.extending import intrinsic
from numba.np.numpy_support import carray
from numpy.typing import NDArray

Array = NDArray[np.float64]


def digest() -> str:
    """A name for the simulator's sources as they stand.

    numba keeps what it has compiled until the function's own file changes. The name is a part of
    each record's type, so that what was compiled with another file's older text is not found.
    """
    whole = hashlib.sha256()
    for file in sorted(Path(__file__).parent.rglob("*.py")):
        whole.update(file.read_bytes())
    return whole.hexdigest()[:12]


SOURCES = digest()


def record(*fields: Any) -> np.dtype[Any]:
    """A record's type: of names (one float each), or (name, kind) and (name, kind, shape)."""
    named = [(field, "f8") if isinstance(field, str) else field for field in fields]
    # As numpy's own record type, whose fields are attributes too.
    return np.dtype((np.record, [*named, (f"of_{SOURCES}", "i8")]))


def integers(*names: str) -> list[tuple[str, str]]:
    """Fields of a record that are whole numbers: of things, or addresses."""
    return [(name, "i8") for name in names]


def vectors(size: int, *names: str) -> list[tuple[str, str, tuple[int]]]:
    """Fields of a record that have so many floats each."""
    return [(name, "f8", (size,)) for name in names]


def reads(kind: Any) -> Any:
    """For compiled functions: what lies at an address, a record or numbers of numba's kind."""

    def at(typingctx: Any, address: Any) -> Any:
        def code(context: Any, builder: Any, signature: Any, args: Any) -> Any:
            return builder.inttoptr(args[0], context.get_value_type(signature.return_type))

        return kind(types.int64), code

    return intrinsic(at)


def _call(typingctx: Any, function: Any, argument: Any) -> Any:
    """Call the compiled function at an address with the record at another."""

    def code(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        word = ir.IntType(64)
        kind = ir.FunctionType(ir.VoidType(), [word])
        builder.call(builder.inttoptr(args[0], kind.as_pointer()), [args[1]])
        return context.get_dummy_value()

    return types.void(types.int64, types.int64), code


floats = reads(types.CPointer(types.float64))
whole_numbers = reads(types.CPointer(types.int64))
call: Any = intrinsic(_call)


@njit(error_model="numpy")
def vector(address: int, size: int) -> Array:
    """(size,) floats at an address."""
    return carray(floats(address), (size,))


@njit(error_model="numpy")
def matrix(address: int, rows: int, columns: int) -> Array:
    """(rows, columns) floats at an address."""
    return carray(floats(address), (rows, columns))


@njit(error_model="numpy")
def indices(address: int, size: int) -> NDArray[np.int64]:
    """(size,) whole numbers at an address."""
    return carray(whole_numbers(address), (size,))


def compiled(dtype: np.dtype[Any]) -> Callable[[Callable[[Any], None]], Any]:
    """A decorator: the function of one record of this type, compiled, with an `address`."""
    signature = types.void(from_dtype(dtype))

    def compile_(function: Callable[[Any], None]) -> Any:
        return cfunc(signature, cache=True, error_model="numpy")(function)

    return compile_


def is_fresh(function: Any) -> bool:
    """Whether a compiled function had to be compiled just now, as nothing was kept of it."""
    return int(function.cache_hits) == 0


def addresses(array: NDArray[Any]) -> NDArray[np.int64]:
    """(n,) of an array's parts along its first axis, whose numbers lie side by side."""
    assert array.flags.c_contiguous
    first, step = array.ctypes.data, array.strides[0]
    return np.arange(first, first + step * len(array), step)


@njit(cache=True, error_model="numpy")
def each(functions: NDArray[np.int64], trials: NDArray[np.int64]) -> None:
    """Call functions, one after the other, with each trial in turn."""
    for trial in trials:
        for function in functions:
            call(function, trial)
