"""Ctrl-C during an import waits for its end."""

import signal
from concurrent.futures import ThreadPoolExecutor

import pytest

from edge.interrupt import delayed
from tests.conftest import python


def test_ctrl_c_comes_at_the_end_of_the_block(interruptible):
    steps = []

    @delayed()
    def load():
        signal.raise_signal(signal.SIGINT)
        steps.append("all of it")

    with pytest.raises(KeyboardInterrupt):
        load()
    assert steps == ["all of it"]
    assert signal.getsignal(signal.SIGINT) is interruptible


def test_ctrl_c_comes_instead_of_an_error_that_it_may_have_caused(interruptible):
    @delayed()
    def load():
        signal.raise_signal(signal.SIGINT)
        raise ImportError

    with pytest.raises(KeyboardInterrupt):
        load()


def test_a_program_that_ignores_ctrl_c_still_does(interruptible):
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    with delayed():
        signal.raise_signal(signal.SIGINT)
    assert signal.getsignal(signal.SIGINT) is signal.SIG_IGN


def test_a_thread_imports_without_it(interruptible):
    entered = []

    def enter():
        with delayed():
            entered.append(signal.getsignal(signal.SIGINT))

    with ThreadPoolExecutor(1) as threads:
        threads.submit(enter)
    assert entered == [interruptible]


HEARD = """
import signal, sys
from edge import demo
from edge.__main__ import start

signal.signal(signal.SIGINT, signal.default_int_handler)

class Watch:
    def find_spec(name, path=None, target=None):
        if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
            print(name, file=sys.stderr)

sys.meta_path.insert(0, Watch)
start("edge.app.cli", ["run", "--model", str(demo.MODEL), "--fake", str(demo.recordings()[0])])
"""


def test_extension_modules_that_lose_ctrl_c_are_imported_within_it():
    process = python("-c", HEARD)
    assert process.returncode == 0
    losing = ("numpy.random", "onnxruntime")
    assert [name for name in process.stderr.split() if name.startswith(losing)] == []
