"""A model as data is taken up where it lies, and damaged bytes are refused."""

import ctypes
import subprocess

import numpy as np
import pytest

from edge import demo
from edge.decide.model import Model
from export import c_code
from export.image import SIZES, Pools, packed_row
from tests.export.microcontroller.comparison import needs_gcc
from tests.export.microcontroller.machine import COMMON, DEFINED

ACCEPTED, NO_MODEL_THERE, DAMAGED, OF_ANOTHER_SKIN, TOO_LARGE = range(5)


@pytest.fixture(scope="module")
def firmware(tmp_path_factory):
    """A program in C as a library, and its model's bytes."""
    folder = tmp_path_factory.mktemp("c")
    c_code.export(Model(demo.MODEL), folder)
    sources = [path for path in folder.glob("*.c") if path.name != "main.c"]
    words = ["-shared", "-fPIC", *sources, "-o", folder / "model.so"]
    subprocess.run(["gcc", *COMMON, *DEFINED, "-O1", *words], check=True)
    return ctypes.CDLL(folder / "model.so"), (folder / "model.bin").read_bytes()


def at_8(data):
    """Bytes at a multiple of 8."""
    words = np.zeros(len(data) // 8 + 2, np.uint64)
    words.view(np.uint8)[: len(data)] = np.frombuffer(data, np.uint8)
    return words


def taken_up(c, data):
    """What `ec_model` says of bytes, and whether the bits are then as they should be."""
    words = at_8(data)
    outcome = c.ec_model(words.ctypes.data_as(ctypes.c_void_p))
    return outcome, bool(c.ec_selftest() & 1)


@needs_gcc
def test_a_file_is_the_model_in_the_program_and_is_read_where_it_lies(firmware):
    c, data = firmware
    inside = ctypes.c_void_p.in_dll(c, "ec_image")
    assert ctypes.string_at(inside.value, len(data)) == data
    assert taken_up(c, data) == (ACCEPTED, True)
    words = at_8(data)
    beside = ctypes.c_void_p(words.ctypes.data + 4)
    assert c.ec_model(beside) == NO_MODEL_THERE


@needs_gcc
def test_damaged_bytes_are_refused_and_decide_nothing(firmware):
    c, data = firmware
    rng = np.random.default_rng(1)
    for place in [*range(400), *rng.integers(0, len(data), 400).tolist()]:
        damaged = bytearray(data)
        damaged[place] ^= int(rng.integers(1, 256))
        outcome, decides = taken_up(c, bytes(damaged))
        assert outcome == (NO_MODEL_THERE if place < 4 else DAMAGED)
        assert not decides
        assert c.ec_push(None, None, ctypes.c_double(1.0), None, None) == -4
    assert taken_up(c, data) == (ACCEPTED, True)


@needs_gcc
def test_a_model_of_another_skin_or_too_large_is_refused(firmware):
    c, _ = firmware
    source = c_code.Source(Model(demo.MODEL))
    header = source.image._header
    sizes = [(header["sizes"][name], TOO_LARGE) for name in SIZES]
    for field, outcome in ((header["program"], OF_ANOTHER_SKIN), *sizes):
        field += 1
        assert taken_up(c, source.image.data())[0] == outcome
        field -= 1
    assert taken_up(c, source.image.data())[0] == ACCEPTED


def test_numbers_that_are_equal_are_stored_once_and_rows_take_few_bits():
    pools = Pools()
    assert pools.add("words", [7, 8, 9]) == 0
    assert pools.add("words", [8, 9]) == 1
    assert pools.add("words", [9, 8]) == 3
    assert len(packed_row(np.zeros(9, np.int64))) == 1
    assert packed_row(np.array([-2, 1])) == bytes([2, 0b1100])
