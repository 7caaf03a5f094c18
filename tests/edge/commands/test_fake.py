"""`edge-classify fake`: a skin of any size is rehearsed without hardware."""

import json
import signal
from contextlib import contextmanager

from edge import demo
from edge.cli import main
from edge.commands import fake
from edge.commands.output import Output
from edge.recording import load
from edge.skin import file as skinfile


def test_what_to_rehearse_next_is_said_at_a_terminal(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(Output, "of", classmethod(lambda cls, arguments: cls(arguments.json)))
    skin = str(skinfile.shipped("matrix"))
    assert main(["fake", "--skin", skin, "--out", str(tmp_path), "--trials", "1"]) == 0
    still = tmp_path / "still.npz"
    asked = f"edge-classify calibrate --skin {skin} --fake {still} --frames "
    (frames,) = (s for s in capsys.readouterr().out.splitlines() if s.strip().startswith(asked))
    assert int(frames.split()[-1]) == len(load(still).t)


def test_plug_serves_the_skin_until_a_signal_and_names_each_device(monkeypatch, capsys):
    plugged = []

    @contextmanager
    def pretended(adapter):
        plugged.append(adapter.bus.name)
        signal.raise_signal(signal.SIGINT)
        yield f"/dev/i2c-{6 + len(plugged)}"
        plugged.clear()

    monkeypatch.setattr(fake, "plugged", pretended)
    assert main(["fake", "--skin", str(skinfile.shipped("mpr121")), "--plug"]) == 0
    assert json.loads(capsys.readouterr().out) == {
        "event": "plugged",
        "bus": "/dev/i2c-1",
        "device": "/dev/i2c-7",
    }
    assert plugged == []


def test_plug_refuses_a_serial_port_and_a_recording_of_another_skin(tmp_path, capsys):
    skin = tmp_path / "serial.toml"
    skin.write_text(
        "[skin]\nname = 'x'\nrows = 1\ncols = 2\nthreshold_counts = 5\n[[bus]]\n"
        "serial = '/dev/ttyACM0'\nkind = 'block'\nchips = [{ first = [0, 0], block = [1, 2] }]\n"
    )
    assert main(["fake", "--skin", str(skin), "--plug"]) == 2
    assert "/dev/ttyACM0 is a serial port" in capsys.readouterr().err
    touch = str(demo.recordings()[0])
    assert main(["fake", "--skin", str(skinfile.shipped("mpr121")), "--plug", touch]) == 2
    assert "name its own skin file" in capsys.readouterr().err
