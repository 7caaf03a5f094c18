"""A pytest plugin: which tests run through which line of edge/, and how long each takes.

`python -m pytest -p tests.mutation.reach` writes what `REACH_FILE` names.
"""

from __future__ import annotations

import json
import os
import time
from collections.abc import Generator
from pathlib import Path

import coverage
import pytest

from tests.mutation.shapes import ROOT

took: dict[str, float] = {}
measured = coverage.Coverage(data_file=None, source=[str(ROOT / "edge")], check_preimported=False)


def pytest_configure() -> None:
    measured.start()


@pytest.hookimpl(hookwrapper=True)
def pytest_runtest_protocol(item: pytest.Item) -> Generator[None]:
    measured.switch_context(item.nodeid)
    began = time.perf_counter()
    yield
    took[item.nodeid] = time.perf_counter() - began


def pytest_unconfigure() -> None:
    measured.stop()
    data = measured.get_data()
    lines: dict[str, dict[str, list[str]]] = {}
    for file in sorted(data.measured_files()):
        name = Path(file).relative_to(ROOT).as_posix()
        found = data.contexts_by_lineno(file)
        lines[name] = {
            str(line): sorted((c for c in contexts if c), key=lambda c: took.get(c, 0.0))
            for line, contexts in found.items()
        }
    Path(os.environ["REACH_FILE"]).write_text(json.dumps(lines))
