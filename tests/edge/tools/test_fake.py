"""`edge-classify fake`: a skin of any size is rehearsed without hardware."""

import signal
from contextlib import contextmanager

from edge import demo
from edge.recording import load
from edge.skin import file as skinfile
from edge.tools import fake
from tests.edge.skin.small import one_chip


def test_what_to_rehearse_next_is_said_at_a_terminal(edge, tmp_path, monkeypatch):
    monkeypatch.setattr("sys.stdout.isatty", lambda: True)
    skin = skinfile.shipped("matrix")
    options = ("--skin", skin, "--out", tmp_path, "--trials", 1)
    status, out, _ = edge("fake", *options, text=True)
    assert status == 0
    still = tmp_path / "still.npz"
    command = f"edge-classify calibrate --skin {skin} --fake {still} --frames "
    assert f"  {command}{len(load(still).t)}\n" in out


def test_plug_serves_the_skin_until_a_signal_and_names_each_device(edge, monkeypatch):
    plugged = []

    @contextmanager
    def pretended(adapter):
        plugged.append(adapter.bus.name)
        signal.raise_signal(signal.SIGINT)
        yield f"/dev/i2c-{6 + len(plugged)}"
        plugged.clear()

    monkeypatch.setattr(fake, "plugged", pretended)
    status, (event,), _ = edge("fake", "--skin", skinfile.shipped("mpr121"), "--plug")
    assert status == 0
    assert event.pop("event") == "plugged"
    assert event == {"bus": "/dev/i2c-1", "device": "/dev/i2c-7"}
    assert plugged == []


def test_plug_refuses_a_serial_port_and_a_recording_of_another_skin(tmp_path, refused):
    skin = tmp_path / "serial.toml"
    skin.write_text(one_chip(1, 2, bus='serial = "/dev/ttyACM0"', at=""))
    err = refused("fake", "--skin", skin, "--plug")
    assert "/dev/ttyACM0 is a serial port" in err
    options = ("--skin", skinfile.shipped("mpr121"), "--plug", demo.recordings()[0])
    assert "name its own skin file" in refused("fake", *options)
