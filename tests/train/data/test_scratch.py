"""Arrays in temporary files."""

import errno
import os
import pickle
import re
import signal
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from joblib import delayed
from numpy.typing import NDArray

from edge.errors import InputError
from tests.conftest import ROOT, ended
from train.data import scratch as module
from train.data.scratch import Scratch, each_part, let_go
from train.threads import in_processes


@dataclass(frozen=True)
class Record:
    """What has arrays."""

    t: NDArray[np.float64]
    zones: dict[str, NDArray[np.int64]]


@pytest.fixture
def scratch(monkeypatch):
    """A scratch whose files hold a few arrays each."""
    monkeypatch.setattr(module, "CHUNK_BYTES", 1000)
    monkeypatch.setattr(module, "EVERY", 2)
    return Scratch()


def test_what_is_put_is_the_same_once_memory_was_released(scratch):
    rng = np.random.default_rng(0)
    zones = {"skin": rng.integers(0, 9, (40, 5))}
    records = [Record(rng.normal(size=n), zones) for n in (0, 7, 30, 500)]
    stored = [scratch.put_fields(record) for record in records]
    for record, copy in zip(records, scratch.each(stored), strict=True):
        assert copy.t.tobytes() == record.t.tobytes()
        assert copy.zones["skin"].tolist() == zones["skin"].tolist()
        assert copy.t.flags.writeable
    assert pickle.loads(pickle.dumps(scratch)).tables == {}


def mapped_mb():
    """Megabytes of files in the memory of this process."""
    status = Path("/proc/self/status").read_text()
    return int(re.search(r"RssFile:\s+(\d+) kB", status)[1]) / 1000


@pytest.mark.skipif(sys.platform != "linux", reason="Linux tells what is mapped")
def test_one_part_of_an_array_is_in_memory_at_once(scratch):
    values = scratch.empty((8, 1_000_000))
    values += np.arange(8.0)[:, None]
    let_go(values[3:])
    before = mapped_mb()
    for number, part in enumerate(each_part(values)):
        assert part.sum() == number * 1e6
        assert mapped_mb() - before < 20.0
    assert mapped_mb() - before < 4.0


def test_other_processes_map_the_files(scratch):
    stored = scratch.put(np.arange(300.0))
    calls = [delayed(type)(stored), delayed(np.sum)(stored)]
    kind, total = in_processes(2, calls)
    assert kind is np.memmap
    assert total == stored.sum()


def test_a_full_disk_is_named(scratch, monkeypatch):
    """Else the first write to a mapped file ends the program by a signal."""

    def allocate(*arguments):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(module.os, "posix_fallocate", allocate, raising=False)
    with pytest.raises(InputError, match="set TMPDIR to another folder"):
        scratch.put(np.arange(3.0))


SIMULATING = """
import runpy, signal, sys
from train import progress
from train.data.scratch import Scratch
scratch = Scratch()
scratch.empty((3,))
progress.bar = lambda *_, **__: signal.raise_signal(signal.SIGTERM)
sys.argv[1:] = ["simulate", "train/scenes/demo.toml", "--out", "{out}"]
runpy.run_module("train", run_name="__main__")
"""


def test_a_program_that_is_told_to_end_leaves_no_temporary_file(tmp_path):
    (tmp_path / "temporary").mkdir()
    environment = {**os.environ, "TMPDIR": str(tmp_path / "temporary")}
    program = SIMULATING.format(out=tmp_path / "out")
    command = [sys.executable, "-c", program]
    run = ended(*command, cwd=ROOT, env=environment)
    assert run.returncode == 128 + signal.SIGTERM
    assert list((tmp_path / "temporary").iterdir()) == []
