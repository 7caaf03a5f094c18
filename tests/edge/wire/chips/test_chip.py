"""Every chip is identified, set up, checked and read in the same way."""

import numpy as np
import pytest

from edge.wire.chips import ad7147, mpr121
from edge.wire.chips.ad7147 import AD7147
from edge.wire.chips.block import Block
from edge.wire.chips.chip import WrongChip
from edge.wire.chips.mpr121 import MPR121
from edge.wire.fake.ad7147 import FakeAD7147
from edge.wire.fake.block import FakeBlock
from edge.wire.fake.bus import FakeBus
from edge.wire.fake.mpr121 import FakeMPR121
from tests.edge.wire.chips.chips import CHIPS, VALUES, parsed, sense


@pytest.fixture(params=CHIPS, ids=CHIPS)
def pair(request):
    driver, model, address, options = CHIPS[request.param]
    bus = FakeBus(chips={address: model(sense, **options)})
    return bus, bus.chips[address], driver(bus, address, **options)


def test_a_chip_serves_its_values_once_it_is_set_up_also_after_a_reset(pair):
    _, model, chip = pair
    for _ in range(2):
        list(chip.settings())
        values, intact = parsed(chip, getattr(model, "_bits", 16))
        np.testing.assert_array_equal(values, VALUES)
        assert intact.all()
        assert chip.healthy()
        model.reset()
        if not isinstance(chip, Block):  # a microcontroller comes up by itself
            assert not chip.healthy()
            assert not parsed(chip)[1].any()


@pytest.mark.parametrize(
    ("driver", "model", "options"),
    [
        (AD7147, FakeMPR121(sense), {}),
        (MPR121, FakeAD7147(sense), {}),
        (Block, FakeMPR121(sense), {"taxels": 12}),
        (Block, FakeBlock(sense, taxels=24), {"taxels": 12}),
    ],
)
def test_a_constructor_refuses_another_chip(driver, model, options):
    with pytest.raises(WrongChip, match=r"fake, address 0x2c: .*(not|serves)"):
        driver(FakeBus(chips={0x2C: model}), 0x2C, **options)


@pytest.mark.parametrize("name", ["ad7147", "mpr121"])
def test_every_register_that_does_not_keep_its_value_is_found_by_reading_back(name):
    driver, model_class, address, _ = CHIPS[name]
    wide, table = (2, ad7147.START_ROWS) if name == "ad7147" else (1, mpr121.SETTINGS)
    for register, values in table:
        if not any(values):
            continue  # losing a zero changes nothing
        model = model_class(sense)
        keep = model.write

        def forgetful(data, t, register=register, keep=keep, wide=wide):
            first = int.from_bytes(data[:wide], "big")
            keep(data[:wide] if first == register and len(data) > wide else data, t)

        model.write = forgetful
        chip = driver(FakeBus(chips={address: model}), address)
        with pytest.raises(WrongChip, match=f"register {register:#04x}"):
            list(chip.settings())
