"""A damaged file ends in an answer or in one sentence, and takes little memory.

`make fuzz` reads 5,000 files with each reader; `make test` reads a few.
"""

import os
import resource
import signal
from pathlib import Path

import pytest
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st

from edge.errors import EdgeError
from tests.checks.fuzz.readers import READERS, UNPRINTABLE

CORPUS = Path(__file__).parent / "corpus"
BY_NAME = {reader.name: reader for reader in READERS}
FILES = int(os.environ.get("FUZZ_FILES", "30"))
MEGABYTES = 100.0
ENDLESS_S = 60.0
"""Seconds of processor time after which a reader is ended, and pytest with it: it would read
for ever."""

pytestmark = [pytest.mark.slow] if FILES > 100 else []
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
    return next(
        int(line.split()[1]) / 1024 for line in lines if line.startswith(f"{key}:")
    )


def refusal(reader, path):
    """The sentence by which a reader refuses a file; "" if it accepts it."""
    try:
        reader.read(path)
    except EdgeError as error:
        return str(error)
    return ""


def limited_refusal(reader, path):
    """The same of a damaged file, within the limit of memory."""
    Path("/proc/self/clear_refs").write_text("5")  # VmHWM, the peak, starts anew
    before = memory("VmRSS")
    signal.setitimer(signal.ITIMER_VIRTUAL, ENDLESS_S)
    try:
        sentence = refusal(reader, path)
    finally:
        signal.setitimer(signal.ITIMER_VIRTUAL, 0.0)
    assert memory("VmHWM") - before < MEGABYTES
    return sentence


@pytest.fixture
def path_for(tmp_path):
    """Makes the path of a reader's input file, with the files beside it that the reader
    needs."""

    def path(reader):
        reader.beside(tmp_path / "input")
        return tmp_path / f"input{reader.suffix}"

    return path


@each_reader
def test_the_valid_files_are_accepted(reader, path_for):
    path = path_for(reader)
    for data in reader.seeds():
        path.write_bytes(data)
        assert refusal(reader, path) == ""


@each_reader
def test_damaged_files_end_in_an_answer_or_a_printable_sentence(reader, path_for):
    path = path_for(reader)
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
        assert not UNPRINTABLE.search(limited_refusal(reader, path))

    check()


DIGITS = "has 5000 digits; use sys.set_int_max_str_digits() to increase the limit"
BROKE = {
    "arm-deep.toml": "it is nested too deeply",
    "arm-digits.toml": DIGITS,
    "csv_frames-utf8.one": "labels.csv: not a table of labels: it is not UTF-8 text",
    "model-gather.onnx": "was changed or damaged since its export",
    "recording-token.npz": "has a part 't', which no recording has",
    "rosbag-header.bag": "Header field could not be parsed.; copy it again",
    "rosbag-size.bag": "Declared field size is too large for header.; copy it again",
    "scene-digits.toml": DIGITS,
}
"""Files that once broke a reader, and words of the sentence that refuses each."""


@pytest.mark.parametrize(("name", "sentence"), BROKE.items(), ids=BROKE)
def test_a_file_that_once_broke_a_reader_is_refused_with_a_sentence(
    name,
    sentence,
    path_for,
):
    reader = BY_NAME[name.split("-")[0]]
    path = path_for(reader)
    path.write_bytes((CORPUS / name).read_bytes())
    assert sentence in limited_refusal(reader, path)


def test_every_file_that_once_broke_a_reader_has_its_sentence():
    assert sorted(path.name for path in CORPUS.iterdir()) == sorted(BROKE)
