"""The facts of a board, with their remedies."""

import numpy
import pytest

from edge import __version__
from edge.app import board as board_module
from edge.decide.info import FORMAT


@pytest.fixture
def board(tmp_path, monkeypatch):
    """A machine with the given devices, of which one belongs to another group."""
    (tmp_path / "dev").mkdir()
    monkeypatch.setattr(
        board_module.os,
        "access",
        lambda device, mode: device.name != "i2c-7",
    )
    monkeypatch.setattr(board_module.os, "getloadavg", lambda: (0.1, 0.1, 0.1))

    def look(**adapters):
        for device, name in adapters.items():
            (tmp_path / "dev" / device.replace("_", "-")).touch()
            folder = tmp_path / "sys/class/i2c-dev" / device.replace("_", "-")
            folder.mkdir(parents=True)
            (folder / "name").write_text(f"{name}\n")
        return {row.name: row for row in board_module.look(tmp_path)}

    return look


def test_a_board_is_told_what_it_has(board):
    rows = board(i2c_1="bcm2835")
    assert (
        rows["program"].value
        == f"edge-classify {__version__}; reads models of format {FORMAT}"
    )
    assert rows["numpy"].value == numpy.__version__
    assert rows["/dev/i2c-1"].value.startswith("bcm2835, group ")
    assert not any(row.remedy for row in rows.values())


def test_a_group_without_a_name_is_a_number(board, monkeypatch):
    monkeypatch.setattr(board_module.grp, "getgrgid", {}.__getitem__)
    assert board(i2c_1="bcm2835")["/dev/i2c-1"].value[-1].isdecimal()


def test_what_a_board_lacks_comes_with_its_remedy(board, monkeypatch):
    assert "raspi-config" in board()["/dev/i2c-*"].remedy
    rows = board(i2c_1="bcm2835", i2c_7="CP2112")
    assert "/dev/i2c-*" not in rows
    assert "sudo usermod -aG i2c $USER" in rows["/dev/i2c-7"].remedy
    monkeypatch.setattr(board_module.os, "getloadavg", lambda: (99.0, 0.0, 0.0))
    monkeypatch.setattr(board_module.time, "time", lambda: 0.0)
    monkeypatch.setattr(board_module, "PACKAGES", ("no-such",))
    rows = board()
    remedies = {name for name, row in rows.items() if row.remedy}
    assert remedies == {"no-such", "clock", "load", "/dev/i2c-7"}
    assert rows["no-such"].remedy == "run `pip install no-such`"
