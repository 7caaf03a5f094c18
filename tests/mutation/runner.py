"""Run the tests on copies of the tree in which one thing is otherwise."""

from __future__ import annotations

import contextlib
import io
import multiprocessing
import os
import resource
import shutil
import sys
import tempfile
import time
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess
from pathlib import Path
from typing import Any

from tests.mutation.shapes import ROOT

LEFT = (".*", "build", "dist", "*.egg-info")
"""What a copy leaves behind; compiled files go with it, which saves each mutant their making."""
PRELOADED = ("hypothesis", "onnxruntime", "scipy.ndimage", "skl2onnx", "sklearn.neighbors")
"""Loaded once, so that each forked process begins with them; none of the project's own."""
LIMIT_S = 600.0
"""A mutant that runs longer hangs; a suite that hangs notices it."""
MEMORY = 12 << 30
HARD = "tests/hard_cases/test_hard_cases.py"


@dataclass(frozen=True)
class Job:
    """One change of one file, and who is asked whether it matters.

    Attributes:
        name: for people.
        file: the file, from the root of the checkout.
        text: what it holds instead.
        stages: arguments of pytest, one run after another until one fails.
    """

    name: str
    file: str
    text: str
    stages: tuple[tuple[str, ...], ...]


def mirror(file: str) -> str:
    """The test file of a module."""
    path = Path(file)
    return (Path("tests") / path.parent / f"test_{path.name}").as_posix()


def stages(file: str, first: Sequence[tuple[str, ...]] = ()) -> tuple[tuple[str, ...], ...]:
    """Who tests a module: those named, its mirror, its package's tests, hard cases, all others."""
    top = Path("tests") / Path(file).parts[0]
    nearest = [*first]
    if (ROOT / mirror(file)).exists():
        nearest.append((mirror(file),))
    if (ROOT / "tests" / Path(file).parent).is_dir() and Path(file).parent.name != top.name:
        nearest.append(((Path("tests") / Path(file).parent).as_posix(),))
    return (*nearest, ("tests/golden", HARD), (top.as_posix(),), ("tests/train", "tests/export"))


IN_A_BROWSER = (
    "--deselect=tests/train/report/test_html.py::test_in_a_browser",
    "--deselect=tests/train/study/test_study_report.py::test_in_a_browser",
)
"""Tests that would fail for want of memory, whatever the change."""


class First:
    """A pytest plugin that remembers the first test, or file of tests, that failed."""

    name = ""

    def pytest_runtest_logreport(self, report: Any) -> None:
        """Called with what came of each part of a test."""
        if report.failed and not self.name:
            path, _, test = report.nodeid.partition("::")
            self.name = f"{Path(path).name}::{test}" if test else Path(path).name

    pytest_collectreport = pytest_runtest_logreport


def failed(folder: str, job: Job) -> str:
    """The first test that fails on the copy; "" where none does."""
    import pytest

    for stage in job.stages:
        first = First()
        options = ["-x", "-q", "--tb=no", "-p", "no:cacheprovider", "-p", "no:xdist", *IN_A_BROWSER]
        with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
            status = pytest.main([*options, "--rootdir", folder, *stage], plugins=[first])
        if first.name:
            return first.name
        if status not in (pytest.ExitCode.OK, pytest.ExitCode.NO_TESTS_COLLECTED):
            return f"{stage[0]} did not run: {status!r}"
    return ""


def child(folder: str, job: Job, answer: Connection) -> None:
    """Be the process that asks the tests."""
    os.setpgrp()  # so that what it starts ends with it
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    for name in [n for n in sys.modules if n.split(".")[0] in ("tests", "edge", "train", "export")]:
        del sys.modules[name]
    sys.path[:] = [folder, *(p for p in sys.path if p not in ("", str(ROOT)))]
    os.environ["PYTHONPATH"] = folder
    os.environ["HYPOTHESIS_STORAGE_DIRECTORY"] = f"{folder}/.hypothesis"
    sys.dont_write_bytecode = True
    os.chdir(folder)
    answer.send(failed(folder, job))


def prepared(folder: str, job: Job, previous: str) -> None:
    """Make the copy the tree with the job's change alone."""
    if previous:
        shutil.copy2(ROOT / previous, Path(folder) / previous)
    path = Path(folder) / job.file
    path.write_text(job.text)
    # A copy of the compiled file would be taken for the new text of the same second.
    for stale in path.parent.glob(f"__pycache__/{path.stem}.*"):
        stale.unlink()


def run(work: Iterable[Job], jobs: int) -> Iterator[tuple[Job, str, float]]:
    """Each job with the test that noticed it and the seconds taken, as they come.

    Yields:
        The job, the first test that failed ("" where none did), and its time.
    """
    for name in PRELOADED:
        __import__(name)
    context = multiprocessing.get_context("fork")
    waiting = iter(work)
    with tempfile.TemporaryDirectory() as root:
        free: list[tuple[str, str]] = []
        for i in range(jobs):
            shutil.copytree(ROOT, f"{root}/{i}", ignore=shutil.ignore_patterns(*LEFT))
            free.append((f"{root}/{i}", ""))
        busy: dict[Connection, tuple[BaseProcess, Job, str, float]] = {}
        while True:
            while free and (job := next(waiting, None)) is not None:
                folder, previous = free.pop()
                prepared(folder, job, previous)
                answer, say = context.Pipe(duplex=False)
                process = context.Process(target=child, args=(folder, job, say))
                process.start()
                say.close()
                busy[answer] = (process, job, folder, time.monotonic())
            if not busy:
                return
            ready = set(wait(list(busy), timeout=1.0))
            for answer, (process, job, folder, began) in list(busy.items()):
                took = time.monotonic() - began
                if answer in ready:
                    try:
                        noticed = answer.recv()
                    except EOFError:
                        noticed = "the tests' process died"
                elif took > LIMIT_S:
                    noticed = f"still running after {LIMIT_S:g} s"
                else:
                    continue
                with contextlib.suppress(ProcessLookupError):
                    os.killpg(process.pid or 0, 9)
                process.join()
                del busy[answer]
                free.append((folder, job.file))
                yield job, noticed, took
