"""Compiled functions are called by their addresses, and forget what older sources gave."""

import importlib
import shutil
import sys
from pathlib import Path

import numpy as np
import pytest
from numba import from_dtype, njit

from train.simulate import compiled

NOTE = compiled.record("name", ("log", "i8"))


@njit
def say(t, what):
    log = compiled.vector(t.log, 16)
    log[0] += 1.0
    log[int(log[0])] = 10.0 * t.name + what


@compiled.compiled(NOTE)
def first(t):
    say(t, 1.0)


@compiled.compiled(NOTE)
def second(t):
    say(t, 2.0)


def test_each_calls_the_functions_in_order_for_one_trial_after_the_other():
    log, trials = np.zeros(16), np.zeros(3, dtype=NOTE)
    trials["name"], trials["log"] = [1, 2, 3], log.ctypes.data
    functions = np.array([f.address for f in (second, first, second)])
    compiled.each(functions, compiled.addresses(trials)[[2, 0]])
    assert log[: 1 + int(log[0])].tolist() == [6, 32, 31, 32, 12, 11, 12]


@njit
def mark(address, rows, columns):
    numbers = compiled.matrix(address, rows, columns)
    numbers[1, 2] = -1.0
    return compiled.vector(address, rows * columns).sum()


def test_addresses_are_those_of_an_array_s_parts():
    values = np.arange(24.0).reshape(3, 2, 4)
    found = compiled.addresses(values)
    assert found.tolist() == [part.ctypes.data for part in values]
    sums = values.sum(axis=(1, 2)) - values[:, 1, 2] - 1.0
    assert [mark(address, 2, 4) for address in found] == sums.tolist()
    assert (values[:, 1, 2] == -1.0).all()
    assert compiled.indices(compiled.addresses(np.arange(6).reshape(2, 3))[1], 3).tolist() == [
        3,
        4,
        5,
    ]
    with pytest.raises(AssertionError):
        compiled.addresses(values.T)


@pytest.fixture
def sources(tmp_path, monkeypatch):
    """A copy of the simulator's folder in its place."""
    folder = Path(compiled.__file__).parent
    copy = shutil.copytree(folder, tmp_path / "simulate", ignore=lambda *_: ["__pycache__"])
    monkeypatch.setattr(compiled, "__file__", str(copy / "compiled.py"))
    return copy


COMPILED = ("compiled.py", "contact.py", "trial.py", "effects/stems.py")


@pytest.mark.parametrize("name", [*COMPILED, "schema.py"])
def test_the_digest_changes_with_whatever_others_compiled_functions_are_made_of(sources, name):
    """The schema's order of effects numbers the slots of their parts."""
    assert compiled.digest() == compiled.SOURCES
    with (sources / name).open("a") as file:
        file.write("x = 1\n")
    assert compiled.digest() != compiled.SOURCES


def test_each_record_s_type_is_of_the_sources_as_they_stand(monkeypatch):
    one = compiled.record("a", ("b", "i8", (2,)))
    assert one.names == ("a", "b", f"of_{compiled.SOURCES}")
    assert from_dtype(one) == from_dtype(compiled.record("a", ("b", "i8", (2,))))
    monkeypatch.setattr(compiled, "SOURCES", "older")
    assert from_dtype(one) != from_dtype(compiled.record("a", ("b", "i8", (2,))))


USER = """
from helper import part
from train.simulate import compiled

NUMBER = compiled.record("value")


@compiled.compiled(NUMBER)
def shrink(t):
    t.value = part(t.value)
"""
HELPER = "from numba import njit\n\n\n@njit\ndef part(x):\n    return x / {}.0\n"


def test_what_was_compiled_with_another_file_s_older_text_is_not_found(sources, monkeypatch):
    monkeypatch.syspath_prepend(str(sources))
    monkeypatch.setattr(sys, "dont_write_bytecode", True)
    (sources / "user.py").write_text(USER)

    def run(by):
        (sources / "helper.py").write_text(HELPER.format(by))
        monkeypatch.setattr(compiled, "SOURCES", compiled.digest())
        for name in ("helper", "user"):
            monkeypatch.delitem(sys.modules, name, raising=False)
        user = importlib.import_module("user")
        number = np.zeros(1, dtype=user.NUMBER)
        number["value"] = 8.0
        compiled.each(np.array([user.shrink.address]), compiled.addresses(number))
        return float(number["value"][0]), compiled.is_fresh(user.shrink)

    assert [run(by) for by in (2, 2, 4, 2)] == [
        (4.0, True),
        (4.0, False),
        (2.0, True),
        (4.0, False),
    ]
