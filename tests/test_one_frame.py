"""The page "The way of one frame" is what a trace of a frame gives."""

import pytest

from tests import one_frame
from tests.conftest import ROOT


@pytest.fixture(scope="module")
def ways():
    return one_frame.ways()


def test_the_page_is_made_from_the_trace():
    page = (ROOT / "docs" / "one-frame.md").read_text()
    assert page == one_frame.page(), (
        "run `python -m tests.one_frame > docs/one-frame.md`"
    )


def test_a_frame_passes_the_rooms_in_one_direction(ways):
    steps = [f"{step.path}:{step.name}" for step in ways["decision"]]
    way = [
        "edge/skin/skin.py:Skin.read",
        "edge/skin/bus_reader.py:BusReader.read",
        "edge/chips/ad7147.py:AD7147.read",
        "edge/skin/decoder.py:Decoder.decode",
        "edge/classifier.py:Classifier.push",
        "edge/touch/active.py:ActiveTaxels.largest",
        "edge/touch/contact.py:Contact.add",
        "edge/touch/features.py:feature_vector",
        "edge/model/model.py:Model.run",
        "edge/answers.py:_answer",
    ]
    places = [steps.index(step) for step in way]
    assert places == sorted(places)


@pytest.mark.parametrize(("frame", "most"), [("decision", 20), ("contact", 13)])
def test_a_frame_visits_few_files(ways, frame, most):
    assert 0 < len(one_frame.files(ways[frame])) <= most


def test_a_frame_that_decides_nothing_asks_the_model_nothing(ways):
    assert ways["contact"]
    assert "edge/model/model.py" not in one_frame.files(ways["contact"])
