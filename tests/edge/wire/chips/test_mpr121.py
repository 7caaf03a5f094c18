"""The MPR121: stopped, written and started; its words and its bits on the wire."""

import numpy as np
import pytest

from edge.wire.chips import mpr121
from edge.wire.chips.chip import ChipSpec, WrongChip
from edge.wire.chips.mpr121 import MPR121
from edge.wire.fake.bus import FakeBus
from edge.wire.fake.mpr121 import FakeMPR121
from tests.edge.wire.chips.chips import sense

SPEC = ChipSpec(MPR121, 0x5A, tuple(range(12)))


@pytest.fixture
def model():
    return FakeMPR121(sense)


@pytest.fixture
def chip(model):
    return MPR121(FakeBus(chips={0x5A: model}), 0x5A)


def test_is_stopped_written_and_started_once(model, chip):
    sent = []
    write = model.write
    model.write = lambda data, t: (sent.append(data), write(data, t))
    list(chip.settings())
    ecr = [d for d in sent if len(d) == 2 and d[0] == mpr121.ECR]
    assert ecr == [b"\x5e\x00", b"\x5e\x8f"]
    assert sent[0] == b"\x80\x63"


def test_parses_low_byte_first_and_tells_damaged_and_saturated_words():
    data = np.zeros((1, 24), dtype=np.uint8)
    data[0, :6] = 0x34, 0x02, 0x34, 0x06, 0xFF, 0x03
    data[0, 6:8] = 0xFE, 0x03
    values, intact = MPR121.parse(data, SPEC)
    assert values[0, :4].tolist() == [0x234, 0x634, 1023, 1022]
    assert intact[0].tolist() == [True, False, False, True] + [False] * 8


def test_over_current_is_named_with_its_resistor_and_later_shows_as_lost_settings(
    model, chip
):
    """It forbids ECR, so that the chip cannot start."""
    list(chip.settings())
    model.over_current = True
    model.write(b"\x00", 0.0)
    assert not chip.healthy()
    with pytest.raises(
        WrongChip, match="over-current; check the resistor at its pin REXT"
    ):
        list(chip.settings())
