"""`edge-classify fake`: a skin of any size is rehearsed without hardware."""

from edge.record.recording import load
from edge.wire.skin import file as skinfile
from tests.edge.test_writing import left_by_a_dead_run


def test_what_to_rehearse_next_is_said_at_a_terminal(edge, tmp_path, monkeypatch):
    monkeypatch.setattr("sys.stdout.isatty", lambda: True)
    skin = skinfile.shipped("matrix")
    options = ("--skin", skin, "--out", tmp_path, "--trials", 1)
    leftover = left_by_a_dead_run(tmp_path / "touches")
    status, out, _ = edge("fake", *options, text=True)
    assert status == 0
    assert not leftover.exists()
    still = tmp_path / "still.npz"
    command = f"edge-classify calibrate --skin {skin} --fake {still} --frames "
    assert f"  {command}{len(load(still).t)} --yes\n" in out
