"""The wiring of a skin: the taxel of each stage, and conflicts between chips."""

from dataclasses import replace

import pytest

from edge.wire.chips.chip import UNUSED
from edge.wire.skin import file as skinfile
from tests.edge.wire.skin.small import SMALL, mistake, one_chip


def test_first_and_block_number_the_stages_row_by_row():
    chip = skinfile.parse(SMALL).buses[0].chips[1]
    assert chip.taxels == (3, 4, 5, 9, 10, 11, 15, 16, 17, 21, 22, 23)
    assert chip.kind.name == "ad7147"
    assert chip.mux == 0x70
    assert chip.channel == 0
    assert chip.address == 0x2D


def test_a_chip_may_have_a_sign_of_its_own():
    text = SMALL.replace(
        "channel = 0, address = 0x2D", "sign = 1, channel = 0, address = 0x2D"
    )
    assert [chip.sign for chip in skinfile.parse(text).chips] == [-1, 1]


def test_taxels_name_each_stage_and_an_empty_one_is_none():
    listed = ", ".join(f"[{i // 3}, {i % 3}]" for i in range(11)) + ", []"
    text = SMALL.replace(
        "{ channel = 0, address = 0x2C, first = [0, 0] }",
        f"{{ channel = 0, address = 0x2C, taxels = [{listed}] }}",
    )
    file = skinfile.parse(text)
    assert file.chips[0].taxels == (0, 1, 2, 6, 7, 8, 12, 13, 14, 18, 19, UNUSED)
    assert len(file.served) == 23


@pytest.mark.parametrize(
    ("old", "new", "sentence"),
    [
        ("device = 1", "", "bus 0: device must be the number of a bus or its path"),
        (
            "device = 1",
            "device = 1\nclock_hz = 1000000",
            "a TCA9548A carries at most 400000",
        ),
        ('kind = "ad7147"', 'kind = "adxl"', "kind must be one of ad7147"),
        ("mux = 0x70", "mux = 0x60", "bus 0 chip 0: mux must be 0x70 to 0x77, not 96"),
        ("mux = 0x70", "", "bus 0 chip 0: channel needs mux"),
        (
            "channel = 0, address = 0x2D",
            "channel = 8, address = 0x2D",
            "channel must be a whole",
        ),
        (
            "address = 0x2D",
            "address = 0x2C",
            "bus 0 chip 1 has the same address as chip 0",
        ),
        (
            "address = 0x2D",
            "address = 0x5A",
            "bus 0 chip 1: address must be 0x2c to 0x2f, not 90",
        ),
        (
            "first = [0, 3]",
            "first = [0, 2]",
            "taxel [0, 2] belongs to bus 0 chip 0 already",
        ),
        (
            "first = [0, 3]",
            "first = [0, 4]",
            "first must be [row, col] within 4 x 6, not [0, 6]",
        ),
        (
            "first = [0, 3]",
            "first = 3",
            "bus 0 chip 1: first must be [row, col], not 3",
        ),
        ("block = [4, 3]", "block = [5, 3]", "block must be [rows, cols] within 4 x 6"),
        ("first = [0, 3]", "taxels = 3", "taxels must be a list of [row, col]"),
        (
            "block = [4, 3]",
            "block = [4, 2]",
            "names 8 taxels, but an AD7147 has 12 stages",
        ),
        (
            "device = 1",
            'device = "a\\u0000b"',
            "device must be the number of a bus or its path",
        ),
    ],
)
def test_a_mistake_is_one_sentence_that_names_file_and_key(old, new, sentence):
    assert sentence in mistake(SMALL.replace(old, new, 1))


SERIAL = one_chip(2, 3, bus='serial = "/dev/ttyACM0"', at="")


@pytest.mark.parametrize("number", [0, 1048575])
def test_a_bus_is_named_by_its_number(number):
    text = SERIAL.replace('serial = "/dev/ttyACM0"', f"device = {number}")
    (bus,) = skinfile.parse(text.replace("{ first", "{ address = 8, first")).buses
    assert bus.device == f"/dev/i2c-{number}"
    assert not bus.serial


@pytest.mark.parametrize(("rows", "is_too_large"), [(40, False), (41, True)])
def test_a_chip_serves_at_most_so_many_taxels(rows, is_too_large):
    text = one_chip(rows, 100, bus='serial = "/dev/ttyACM0"', at="")
    if is_too_large:
        assert "names 4100 taxels" in mistake(text)
    else:
        assert len(skinfile.parse(text).served) == 4000


def test_a_microcontroller_may_stand_on_a_serial_port_and_serve_a_single_taxel():
    (bus,) = skinfile.parse(SERIAL.replace("[2, 3] }", "[1, 1] }")).buses
    assert bus.device == "/dev/ttyACM0"
    assert bus.serial
    assert bus.clock_hz == 115_200
    (chip,) = bus.chips
    assert chip.kind.name == "block"
    assert chip.address == 0
    assert chip.taxels == (0,)


@pytest.mark.parametrize(
    ("old", "new", "sentence"),
    [
        ("[[bus]]", "[[bus]]\ndevice = 1", "unknown key device; allowed: serial, baud"),
        ('"block"', '"mpr121"', "kind is mpr121; a serial port carries block only"),
        (
            '"block"',
            '"microcontroller"',
            "kind must be one of ad7147, mpr121, block, not 'micro",
        ),
        (
            "= [{",
            "= [{ first = [0, 0], block = [1, 1] }, {",
            "has 2; a serial port has one",
        ),
        (
            "[{ first",
            "[{ address = 8, first",
            "unknown key address; allowed: kind",
        ),
    ],
)
def test_a_mistake_about_a_serial_port_is_one_sentence(old, new, sentence):
    assert sentence in mistake(SERIAL.replace(old, new))


def test_the_largest_value_of_a_microcontroller_is_that_of_its_bits():
    chip = skinfile.load(skinfile.shipped("matrix")).chips[0]
    assert replace(chip, options={"bits": 12}).traits.highest == 4095
