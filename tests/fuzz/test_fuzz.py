"""A few hostile files of each kind end in an answer or a sentence; `make fuzz` reads thousands."""

from pathlib import Path
from random import Random

import pytest

from edge.errors import EdgeError
from tests.fuzz import mutate
from tests.fuzz.__main__ import judged
from tests.fuzz.readers import READERS, hostile

CORPUS = Path(__file__).parent / "corpus"
KEPT = sorted(CORPUS.glob("*"))
BY_NAME = {reader.name: reader for reader in READERS}


@pytest.mark.parametrize("reader", READERS, ids=lambda reader: reader.name)
def test_the_valid_files_are_accepted(reader, tmp_path):
    path = tmp_path / f"input{reader.suffix}"
    reader.more(path)
    refusals = []
    for data in reader.seeds():
        path.write_bytes(data)
        try:
            reader.read(path)
        except EdgeError as error:
            refusals.append(str(error))
    assert refusals == []


@pytest.mark.parametrize("reader", READERS, ids=lambda reader: reader.name)
def test_hostile_files_end_in_an_answer_or_a_sentence(reader, tmp_path):
    path = tmp_path / f"input{reader.suffix}"
    reader.more(path)
    seeds = reader.seeds()
    for number in range(len(seeds), 40):
        path.write_bytes(hostile(reader, number, seeds))
        assert judged(reader, path) == "", f"make fuzz: {reader.name} {number}"


@pytest.mark.parametrize("kept", KEPT, ids=lambda path: path.name)
def test_what_once_went_wrong_does_not_again(kept, tmp_path):
    reader = BY_NAME[kept.name.split("-")[0]]
    path = tmp_path / f"input{reader.suffix}"
    reader.more(path)
    path.write_bytes(kept.read_bytes())
    assert judged(reader, path) == ""


def test_an_input_hangs_on_its_reader_and_number_alone():
    reader = BY_NAME["scene"]
    seeds = reader.seeds()
    assert hostile(reader, 77, seeds) == hostile(reader, 77, seeds)
    assert hostile(reader, 77, seeds) != hostile(reader, 78, seeds)


def test_most_hostile_texts_are_still_close_to_valid_ones():
    """A text that differs in a word gets past the parser, to where the checks are."""
    text = BY_NAME["scene"].seeds()[0]
    kept = [len(mutate.of_text(text, Random(i))) for i in range(50)]
    assert sum(abs(size - len(text)) < 200 for size in kept) > 25
