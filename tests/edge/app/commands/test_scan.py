"""`scan` as a user runs it, over the fake."""

from dataclasses import replace

import numpy as np
import pytest

from edge.app.commands.scan import below_rest
from edge.record import saving
from edge.wire.fake.clock import VirtualClock
from edge.wire.fake.player import calibrated, fake_buses
from edge.wire.fake.touches import still
from edge.wire.skin import file as skinfile
from edge.wire.skin.skin import Skin


def test_scan_over_the_fake_maps_the_whole_skin(edge, quiet):
    status, events, err = edge("scan", "--fake", quiet)
    assert status == 0
    assert [e["state"] for e in events] == ["running"] * 32
    assert err.count("|" + "#" * 24 + "|") == 16


@pytest.mark.parametrize(("threshold", "count"), [(12, 7), (0, 0)])
def test_scan_counts_taxels_that_were_touched_when_they_were_calibrated(
    threshold, count
):
    """Without a threshold nothing tells them from noise."""
    file = calibrated(skinfile.load(skinfile.shipped("mpr121")))
    layout = replace(file.layout, threshold_counts=threshold)
    file = replace(file, layout=layout)
    clock = VirtualClock()
    silence = np.zeros(file.layout.shape, np.uint16)
    buses = fake_buses(file, lambda t: silence, clock)
    touched = file.calibration.baseline.astype(np.int32)
    touched.flat[:7] -= 100
    calibration = replace(file.calibration, baseline=touched)
    with Skin(replace(file, calibration=calibration), buses, clock=clock) as skin:
        skin.start()
        skin.read()
        assert below_rest(skin) == count


def test_a_microcontroller_that_hangs_with_an_intact_frame_is_heard_of(
    edge,
    tmp_path,
    monkeypatch,
    capsys,
):
    """Its sequence number stands still."""
    monkeypatch.setattr("edge.wire.fake.block.RATE_HZ", 0.0)
    skin = skinfile.shipped("matrix")
    rest = tmp_path / "rest.npz"
    saving.save(rest, still(skinfile.load(skin), 2.0))
    monkeypatch.setattr("edge.wire.fake.player.NOISE_COUNTS", 0.0)
    fake = ("--skin", skin, "--fake", rest)
    status, (chip,), err = edge("scan", *fake)
    assert status == 1
    assert chip["state"] == "running"
    assert chip["invalid"] == 100
    assert err.count("|" + "." * 10 + "|") == 10
    assert err.endswith("0 of 1 chips answer; taxels without a valid value: 100\n")
