"""Arrays in temporary files."""

import pickle
from dataclasses import dataclass

import numpy as np
import pytest
from joblib import delayed
from numpy.typing import NDArray

from train.data import scratch as module
from train.data.scratch import Scratch
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
    for record, other in zip(records, scratch.each(stored), strict=True):
        assert other.t.tobytes() == record.t.tobytes()
        assert other.zones["skin"].tolist() == zones["skin"].tolist()
        assert other.t.flags.writeable
    assert pickle.loads(pickle.dumps(scratch)).kept == {}


def test_other_processes_map_the_files(scratch):
    stored = scratch.put(np.arange(300.0))
    calls = [delayed(type)(stored), delayed(np.sum)(stored)]
    kind, total = in_processes(2, calls)
    assert kind is np.memmap
    assert total == stored.sum()
