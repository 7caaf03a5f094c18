"""The real grasps as recordings, number by number, and files of theirs that are
damaged."""

import bz2
import math
import struct

import numpy as np
import pytest

from edge.errors import InputError
from edge.record.recording import load
from edge.touch.arm import Chain
from train.__main__ import main
from train.data.dataset import Measurement, load_trials
from train.importers import sdh2

MASK = "\n".join(["011110"] * 5 + ["111111"] * 8)


def packed(values) -> str:
    return "".join(struct.pack(">f", value).hex().upper() for value in values)


FRAMES = [
    # 84 cells of matrix 0, 78 of matrix 1, 246 of matrices 2 to 4, 78 of matrix 5.
    [-486],
    [-84, -8, 70, 80, -68, -246, 90, -77],
    [-84, -8, 170, 180, -68, -246, -77, 4095],
]
ANGLES = [(0, [0.0] * 7), (40, [90.0] * 7)]


def dsa(
    frames=FRAMES,
    stamps=(1000, 1032, 1064),
    angles=ANGLES,
    mask=MASK,
    width="3.4",
    pads=range(6),
) -> str:
    matrices = "".join(
        "<matrix "
        f'index="{i}"><cells_x>6</cells_x><cells_y>{13 if i % 2 else 14}</cells_y>'
        f"<texel_width>{width}</texel_width>"
        + (f"<static_mask>{mask}</static_mask>" if i == 1 else "")
        + "</matrix>"
        for i in pads
    )
    data = "".join(
        f"<frame><time_stamp>{stamp}</time_stamp><frame_data>\n  "
        f"{packed(values)}\n</frame_data>"
        "</frame>"
        for stamp, values in zip(stamps, frames, strict=True)
    )
    lines = "".join(
        f"<angle><time_stamp>{1000 + at}</time_stamp>"
        f"<angle_data>{', '.join(map(str, row))}</angle_data></angle>"
        for at, row in angles
    )
    return (
        f"<root><sensor>{matrices}</sensor><data>{data}</data>"
        f"<joint_angles>{lines}</joint_angles></root>"
    )


def write(folder, text, name="cup_1.dsa"):
    file = folder / "cup" / name
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_bytes(bz2.compress(text.encode()) if isinstance(text, str) else text)
    return file


def test_a_grasp_is_unpacked_cell_by_cell(tmp_path):
    recording = sdh2.grasp(write(tmp_path, dsa()))
    left = recording.frames[:, :, :6]
    right = recording.frames[:, :, 7:]
    assert left.reshape(3, -1)[:, 8:10].tolist() == [[0, 0], [70, 80], [170, 180]]
    assert right.reshape(3, -1)[:, [0, -1]].tolist() == [[0, 0], [90, 0], [0, 4095]]
    assert int(recording.frames.sum()) == 70 + 80 + 170 + 180 + 90 + 4095
    assert recording.t.tolist() == [0.0, 0.032, 0.064]
    assert recording.labels == {"object": "cup"}
    assert recording.layout.pitch_m == pytest.approx(0.0034)
    assert recording.layout.force_unit == "count"


def test_masked_texels_and_the_column_between_the_pads_are_dead(tmp_path):
    recording = sdh2.grasp(write(tmp_path, dsa()))
    assert not recording.valid[:, 6].any()
    assert not recording.valid[:5, [0, 5]].any()
    assert recording.valid.sum() == (13 * 6 - 10) + 13 * 6
    assert (recording.layout.alive == recording.valid).all()


def test_joint_angles_are_interpolated_in_radians_and_unknown_far_from_them(tmp_path):
    recording = sdh2.grasp(write(tmp_path, dsa(stamps=(1000, 1032, 1164))))
    assert recording.joints[:2, 3] == pytest.approx([0.0, math.radians(90 * 32 / 40)])
    assert np.isnan(recording.joints[2]).all()
    assert sdh2.grasp(write(tmp_path, dsa(angles=()))).joints is None


@pytest.mark.parametrize(
    ("content", "word"),
    [
        (b"BZh9 no bzip2", "Invalid data stream"),
        ('<!DOCTYPE x [<!ENTITY a "b">]>' + dsa(), "declares a document type"),
        (dsa(frames=[], stamps=()), "has no frame"),
        (dsa(pads=(0, 1, 2)), "lacks matrix 1 or 5"),
        (dsa(mask="01"), "static_mask must be a 0 or 1 for each"),
        (dsa(width="-1"), "texel_width must be"),
        (dsa(frames=[[-485]], stamps=(0,)), "does not unpack to 486"),
        (dsa(frames=[[-485, 0.5]], stamps=(0,)), "no whole number"),
        (dsa().replace("C3F30000", "hello"), "non-hexadecimal number"),
        (dsa().replace('index="0"', f'index="{"1" * 5000}"'), "limit (4300 digits)"),
        (dsa().replace("<time_stamp>1032</time_stamp>", ""), "time_stamp must be"),
        (dsa(angles=[(0, [1.0] * 6)]), "does not hold 7"),
        (dsa(angles=[(40, [0.0] * 7), (0, [0.0] * 7)]), "goes back"),
    ],
)
def test_a_damaged_file_is_one_sentence_that_names_it(content, word, tmp_path, refused):
    file = write(tmp_path, content)
    message = refused("sdh2", tmp_path)
    assert word in message
    assert "cup" in message
    assert file.exists()


@pytest.fixture
def three_grasps(tmp_path):
    """The folder of three imported grasps."""
    for i in range(3):
        write(tmp_path, dsa(), f"cup_{i}.dsa")
    out = tmp_path / "out"
    assert main(["import", "sdh2", str(tmp_path), "--out", str(out)]) == 0
    return out


def test_the_command_writes_a_recording_for_each_grasp(capsys, three_grasps):
    names = sorted(path.name for path in three_grasps.iterdir())
    assert names == ["0000_cup.npz", "0001_cup.npz", "0002_cup.npz"]
    assert load(three_grasps / names[0]).joints.shape == (3, 7)
    assert f"recordings written to {three_grasps}: 3" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("arm", "sentence"), [(None, "holds no OBJECT"), (Chain.cody(), "leave --arm out")]
)
def test_a_folder_without_grasps_or_with_an_arm_is_refused(tmp_path, arm, sentence):
    with pytest.raises(InputError, match=sentence):
        list(sdh2.trials(tmp_path, arm))


def test_what_cannot_be_written_is_not_called_written(capsys, tmp_path):
    table = tmp_path / "cup.csv"
    table.write_text("s1,s2\n0,1\n9,2\n")
    words = ["import", "csv", str(table), "--rate", "9", "--out", str(table)]
    assert main(words) == 2
    assert "written to" not in capsys.readouterr().out


def test_imported_grasps_train_with_the_hands_joints(three_grasps):
    features = Measurement(["contact_motion", "joint_change@2"])
    data = load_trials([three_grasps], features)
    assert data.chain is None
    assert data.joints == 7
    assert data.features(samples=3).shape == (3, 3 + 14)


def test_every_published_grasp_has_frames_and_joint_angles(real):
    """Every sixtieth is read."""
    files = sdh2.files(real / "sdh2_grasps")
    assert len(files) == 856
    assert len({file.parent.name for file in files}) == 36
    for file in files[::60]:
        recording = sdh2.grasp(file)
        assert recording.frames.max() > sdh2.ONSET_COUNTS
        assert recording.joints.shape == (len(recording.t), 7)
        assert np.isfinite(recording.joints).all()
        assert (recording.frames[:, ~recording.valid] == 0).all()
