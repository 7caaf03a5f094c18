"""The time that a frame takes on the wire, by chips and buses."""

from dataclasses import replace

import pytest

from edge.touch.layout import SkinLayout
from edge.wire.skin import file as skinfile
from train.tradeoff.wires import (
    microcontroller,
    spread,
    waited_s,
    wire,
    wire_time_s,
    wires,
)


def test_cody_s_chips_over_three_buses_cost_what_the_shipped_file_costs():
    file = skinfile.load(skinfile.shipped("cody"))
    ours = wire("ours", spread(file.layout, 3))
    shipped = wire("shipped", file)
    assert ours.frame_s == pytest.approx(shipped.frame_s, rel=0.1)


def test_more_buses_share_the_same_bits(forearm):
    one, two, three = (wire("w", spread(forearm, n)) for n in (1, 2, 3))
    assert one.frame_s == pytest.approx(2 * two.frame_s, rel=0.02)
    assert one.every(100.0) == 3
    assert three.every(100.0) == 1


def test_a_single_taxel_is_one_chip_on_one_bus():
    choices = wires(SkinLayout(rows=1, cols=1, wraps=False))
    assert [choice.name for choice in choices] == [
        "AD7147, 1 bus at 400 kHz",
        "microcontroller, 1 bus at 1000 kHz",
    ]


def test_a_skin_is_wired_with_every_chip_that_serves_it(forearm):
    assert [choice.name.split(",")[0] for choice in wires(forearm)] == [
        *["AD7147"] * 3,
        "microcontroller",
    ]


def test_the_wire_is_that_of_the_recordings_or_unknown(make_touch, forearm):
    touch = make_touch()
    assert wire_time_s([touch], forearm, 100.0) is None
    wired = replace(touch, meta={**touch.meta, "wire_s": 0.0182})
    assert wire_time_s([wired], forearm, 100.0) == pytest.approx(0.0232)
    simulated = replace(touch, meta={**touch.meta, "simulation": {}})
    assert 0.005 < wire_time_s([simulated], forearm, 100.0) < 0.02


def test_three_axes_take_three_times_the_bits(forearm):
    three = replace(forearm, axes=3)
    slower = microcontroller(three).frame_s / microcontroller(forearm).frame_s
    assert slower == pytest.approx(3.0, rel=0.01)
    assert waited_s(three, 100.0) > microcontroller(three).frame_s
