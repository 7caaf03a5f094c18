"""A damaged file ends in an answer or in one sentence, within five seconds and little memory.

`make fuzz` reads 5,000 files with each reader; `make test` reads a few.
"""

import faulthandler
import os
import resource
import time
from pathlib import Path

import pytest
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st

from edge.errors import EdgeError
from tests.fuzz.readers import READERS, check_printable

CORPUS = Path(__file__).parent / "corpus"
BY_NAME = {reader.name: reader for reader in READERS}
FILES = int(os.environ.get("FUZZ_FILES", "30"))
SECONDS, MEGABYTES = 5.0, 100.0
HANGS_S = 180.0

each_reader = pytest.mark.parametrize("reader", READERS, ids=lambda reader: reader.name)


@pytest.fixture(autouse=True)
def limited_memory():
    """A reader that asks for more than 8 GB fails, and takes nothing else down."""
    limits = resource.getrlimit(resource.RLIMIT_AS)
    resource.setrlimit(resource.RLIMIT_AS, (8 << 30, limits[1]))
    yield
    resource.setrlimit(resource.RLIMIT_AS, limits)


def memory(key):
    """A figure of /proc/self/status in megabytes."""
    lines = Path("/proc/self/status").read_text().splitlines()
    return next(int(line.split()[1]) / 1024 for line in lines if line.startswith(f"{key}:"))


def read(reader, path):
    """Read a damaged file; an error must be one printable sentence."""
    Path("/proc/self/clear_refs").write_text("5")  # VmHWM, the peak, starts anew
    before, began = memory("VmRSS"), time.process_time()
    faulthandler.dump_traceback_later(HANGS_S, exit=True)
    try:
        reader.read(path)
    except EdgeError as error:
        check_printable(str(error))
    finally:
        faulthandler.cancel_dump_traceback_later()
    assert time.process_time() - began < SECONDS
    assert memory("VmHWM") - before < MEGABYTES


@each_reader
def test_the_valid_files_are_accepted(reader, tmp_path):
    path = tmp_path / f"input{reader.suffix}"
    reader.beside(path)
    for data in reader.seeds():
        path.write_bytes(data)
        reader.read(path)


@each_reader
def test_damaged_files_end_in_an_answer_or_a_sentence(reader, tmp_path):
    path = tmp_path / f"input{reader.suffix}"
    reader.beside(path)
    seeds = reader.seeds()
    path.write_bytes(seeds[0])
    reader.read(path)  # imports count for no file

    @settings(
        max_examples=FILES,
        phases=(Phase.generate, Phase.shrink),
        suppress_health_check=list(HealthCheck),
    )
    @given(st.randoms(use_true_random=False))
    def check(draw):
        path.write_bytes(reader.mutate(draw.choice(seeds), draw))
        read(reader, path)

    check()


@pytest.mark.parametrize("file", sorted(CORPUS.glob("*")), ids=lambda path: path.name)
def test_files_that_once_broke_a_reader(file, tmp_path):
    reader = BY_NAME[file.name.split("-")[0]]
    path = tmp_path / f"input{reader.suffix}"
    reader.beside(path)
    path.write_bytes(file.read_bytes())
    read(reader, path)
