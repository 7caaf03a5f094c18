"""A look before recordings are written."""

import numpy as np

from edge.record.recording import Recording
from tests.train.importers.test_csv import put
from train.__main__ import main
from train.importers.look import contacts_in, rows_of


def recording(peak):
    frames = np.zeros((20, 1, 8), np.uint16)
    frames[10:] = peak
    skin = {"rows": 1, "cols": 8, "threshold_counts": 50}
    joints = np.full((20, 1), 0.5)
    meta = {"skin": skin, "labels": {"object": "cup"}, "joint_names": ["elbow"]}
    return Recording(0.01 * np.arange(20), frames, joints, meta=meta)


def test_five_rows_have_units_and_the_label():
    head, *rows = rows_of(recording(9))
    assert len(rows) == 5
    assert head.split()[:4] == ["time", "(s)", "taxel", "1"]
    assert "joint elbow (rad)" in head
    assert "8 taxels" in rows[0]
    assert rows[1].split()[0] == "0.01"
    assert rows[1].split()[-1] == "cup"


def test_few_contacts_are_told_with_a_reason_and_an_option():
    text = contacts_in([recording(9), recording(11), recording(99)])
    assert text.startswith("1 of 3 have a contact")
    assert "10 counts" in text
    assert "--scale" in text
    assert contacts_in([recording(99)]) == "1 of 1 have a contact"


def test_a_preview_writes_nothing(folder, capsys):
    put(folder, {"cup_1.csv": "t,p1\n0.00,1\n0.01,1\n0.02,90\n0.03,90\n"})
    out = folder.parent / "out"
    assert main(["import", "csv", str(folder), "--preview", "--out", str(out)]) == 0
    assert not out.exists()
    assert main(["import", "csv", str(folder), "--preview"]) == 0
    assert 'taxels: "p1"' in capsys.readouterr().out
    assert main(["import", "csv", str(folder)]) == 2
    assert "--out" in capsys.readouterr().err
