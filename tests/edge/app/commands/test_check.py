"""`edge-classify check`: skins that cannot work, and what may be meant so."""

import numpy
import pytest

from edge.app import board as board_module
from edge.wire.skin import file as skinfile
from edge.wire.skin.calibration import save_calibration
from edge.wire.skin.file import TaxelCalibration
from tests.edge.wire.skin.small import mpr121, one_chip


@pytest.fixture
def checked(edge, tmp_path):
    """Check the text of a skin file; returns status and remarks."""

    def check(text):
        (tmp_path / "skin.toml").write_text(text)
        status, (event,), _ = edge("check", tmp_path / "skin.toml")
        return status, event["remarks"]

    return check


def test_a_pad_that_says_little_is_told_what_is_missing(checked):
    status, remarks = checked(mpr121())
    assert status == 0
    assert [remark.split(":")[0] for remark in remarks] == [
        "pitch_m is missing",
        "not calibrated yet",
    ]


@pytest.mark.parametrize(
    ("text", "status", "sentence"),
    [
        (mpr121(signal="sign = 1"), 1, "a touch lowers an MPR121's values"),
        (
            mpr121(skin="threshold_counts = 2000"),
            1,
            "no contact can begin: onset_counts is 2000, but a taxel gives at most "
            "1022",
        ),
        (one_chip(3, 4), 0, "threshold_counts is missing: anything above the noise"),
        (
            one_chip(3, 4, signal="dead_band_sigma = 0"),
            1,
            "noise of one count begins a contact",
        ),
    ],
)
def test_a_skin_that_cannot_work_is_exit_1(checked, text, status, sentence):
    exit_status, remarks = checked(text)
    assert sentence in " ".join(remarks)
    assert exit_status == status


@pytest.mark.parametrize(
    ("second", "advised"), [("channel = 1,", False), ("mux = 0x71, channel = 1,", True)]
)
def test_several_muxes_on_a_bus_are_advised_against(checked, second, advised):
    text = skinfile.shipped("mpr121").read_text()
    status, remarks = checked(text.replace("channel = 1,", second))
    assert status == 0
    assert ("use one mux, and wire its reset line" in " ".join(remarks)) == advised


def test_check_counts_what_the_wire_carries(edge, skin):
    status, (event,), err = edge("check", skin)
    assert status == 0
    assert event["taxels"] == 384
    assert event["chips"] == 32
    assert event["frame_rate_hz"] == 124.2
    assert event["remarks"] == [
        f"not calibrated yet: run `edge-classify calibrate --skin {skin}`"
    ]
    assert err == ""


@pytest.mark.parametrize(
    ("noise", "hidden"),
    [(0.0, "could freeze unseen"), (0.2, "up to 44 frames"), (4.0, "")],
)
def test_check_names_the_chips_whose_freezing_nothing_would_show(
    edge,
    skin,
    noise,
    hidden,
):
    resting = numpy.full((16, 24), 9000, dtype=numpy.uint16)
    save_calibration(skin, TaxelCalibration(resting, numpy.full((16, 24), noise)))
    _, (event,), _ = edge("check", skin)
    assert all(hidden in remark for remark in event["remarks"])
    assert len(event["remarks"]) == bool(hidden)


def test_the_software_s_time_for_each_transaction_may_be_counted_too(edge, skin):
    """A frame of Cody's first bus takes 12 chips, 3 channels and a check in every
    fourth."""
    _, (bare,), _ = edge("check", skin)
    _, (event,), _ = edge("check", skin, "--overhead", 100)
    assert event["buses"] == bare["buses"]
    assert event["overhead_us"] == 100.0
    frame_s = bare["buses"][0]["bits"] / 400e3
    assert 1.0 / event["frame_rate_hz"] == pytest.approx(frame_s + 1.9e-3, abs=1e-4)


def test_check_says_where_the_wires_are_too_slow(edge, skin):
    text = skin.read_text().replace("verify_mux = true", "verify_mux = false\n")
    skin.write_text(text.replace("clock_hz = 400_000", "clock_hz = 150_000"))
    status, (event,), err = edge("check", skin)
    assert status == 1
    assert event["frame_rate_hz"] == 47.5
    assert err == ""
    assert "asks for 100 Hz, but the wires carry 47.5" in " ".join(event["remarks"])


def test_check_without_a_skin_prints_the_board(edge, monkeypatch):
    rows = [
        board_module.Fact("disk", "5 MB", "delete"),
        board_module.Fact("python", "3.11"),
    ]
    monkeypatch.setattr(board_module, "look", lambda: rows)
    status, (event,), _ = edge("check")
    assert status == 1
    assert event["event"] == "board"
    assert event["rows"][0]["remedy"] == "delete"
    monkeypatch.setattr(board_module, "look", lambda: rows[1:])
    assert edge("check")[0] == 0
