"""Tables of three axes: which column is which axis of which taxel, signs, and what is
refused."""

import numpy as np
import pytest

import edge
from train.__main__ import main
from train.importers.axes import lettered

FRAMES = 60
TAXELS = 4


def values() -> np.ndarray:
    """(frames, taxels, 3) whole numbers x, y, z; z is pressed from frame 20 on."""
    rng = np.random.default_rng(3)
    three = rng.integers(-900, 900, (FRAMES, TAXELS, 3))
    three[..., 2] = rng.integers(200, 2000, (FRAMES, TAXELS))
    three[:20] = 0
    return three


def write(folder, names, columns) -> None:
    folder.mkdir(exist_ok=True)
    lines = [",".join(["t", *names])]
    for n, row in enumerate(columns):
        lines.append(",".join([f"{0.01 * n:.2f}", *map(str, row.tolist())]))
    (folder / "cup_1.csv").write_text("\n".join(lines) + "\n")


def imported(folder, out, *options) -> edge.Recording:
    assert main(["import", "csv", str(folder), "--out", str(out), *options]) == 0
    return edge.load(out / "cup_1.npz")


@pytest.mark.parametrize(
    ("name", "letter", "plain"),
    [
        ("s1_x", "x", "s1"),
        ("s12Z", "z", "s12"),
        ("taxel 3.y", "y", "taxel 3"),
        ("Fx_1", "x", "F1"),
        ("z12", "z", "12"),
        ("y.3", "y", "3"),
        ("taxel_0_3_z", "z", "taxel_0_3"),
    ],
)
def test_a_name_tells_its_axis_and_its_taxel(name, letter, plain):
    assert lettered(name) == (letter, plain)


@pytest.mark.parametrize("name", ["t", "s1", "time_ms", "index", "x"])
def test_other_names_have_no_axis(name):
    assert lettered(name) is None


@pytest.mark.parametrize("form", ["s{i}_{a}", "f{a}{i}", "{a}_{i}"])
def test_each_axis_arrives_in_its_place(form, tmp_path):
    three = values()
    names = [form.format(i=i + 1, a=a) for i in range(TAXELS) for a in "xyz"]
    write(tmp_path / "in", names, three.reshape(FRAMES, -1))
    recording = imported(tmp_path / "in", tmp_path / "out", "--axes", "xyz")
    assert recording.frames[:, 0].tolist() == three[..., 2].tolist()
    assert recording.shear[:, 0].tolist() == three[..., :2].tolist()
    assert recording.layout.axes == 3


def test_the_letters_say_which_axis_is_which_and_signs_are_turned(tmp_path):
    three = values()
    names = [f"s{i + 1}_{a}" for i in range(TAXELS) for a in "yzx"]
    # In this file x is the normal, y runs along the rows, and z around the columns.
    columns = three[..., [0, 1, 2]].reshape(FRAMES, -1)
    write(tmp_path / "in", names, columns)
    recording = imported(
        tmp_path / "in", tmp_path / "out", "--axes", "yzx", "--flip", "yz"
    )
    assert recording.frames[:, 0].tolist() == three[..., 2].tolist()
    assert recording.shear[:, 0].tolist() == (-three[..., :2]).tolist()


def test_columns_of_another_order_give_the_same_taxels(tmp_path):
    three = values()
    names = [f"s{i + 1}_{a}" for i in range(TAXELS) for a in "xyz"]
    order = np.random.default_rng(0).permutation(len(names))
    flat = three.reshape(FRAMES, -1)
    write(tmp_path / "in", [names[i] for i in order], flat[:, order])
    recording = imported(tmp_path / "in", tmp_path / "out", "--axes", "xyz")
    assert recording.shear[:, 0].tolist() == three[..., :2].tolist()


def test_three_arrays_are_three_axes(tmp_path):
    three = values()
    (tmp_path / "in").mkdir()
    arrays = {a: three[..., i] for i, a in enumerate("xyz")}
    np.savez(tmp_path / "in" / "cup_1.npz", t=0.01 * np.arange(FRAMES), **arrays)
    recording = imported(tmp_path / "in", tmp_path / "out", "--axes", "xyz")
    assert recording.frames[:, 0].tolist() == three[..., 2].tolist()
    assert recording.shear[:, 0].tolist() == three[..., :2].tolist()


def test_an_array_whose_last_axis_is_three_has_three_axes(tmp_path):
    three = values()
    (tmp_path / "in").mkdir()
    time = 0.01 * np.arange(FRAMES)
    np.savez(tmp_path / "in" / "cup_1.npz", t=time, tactile=three)
    recording = imported(tmp_path / "in", tmp_path / "out", "--axes", "xyz")
    assert recording.frames[:, 0].tolist() == three[..., 2].tolist()
    assert recording.shear[:, 0].tolist() == three[..., :2].tolist()


def test_signed_values_lose_their_rest_on_each_axis(tmp_path):
    three = values()
    rest = np.array([40, -70, -500])
    names = [f"s{i + 1}_{a}" for i in range(TAXELS) for a in "xyz"]
    write(tmp_path / "in", names, (three + rest).reshape(FRAMES, -1))
    recording = imported(tmp_path / "in", tmp_path / "out", "--axes", "xyz", "--signed")
    counts = recording.meta["values"]["counts_per_unit"]
    assert recording.frames[:, 0].tolist() == (counts * three[..., 2]).tolist()
    assert recording.shear[:, 0].tolist() == (counts * three[..., :2]).tolist()


@pytest.mark.parametrize(
    ("names", "options", "sentence"),
    [
        ("s1_x s1_y s1_z s2_z", ("--axes", "xyz"), "['s2'] lacks one of the axes"),
        ("s1 s2 s3 s4", ("--axes", "xyz"), "no columns are named by an axis"),
        ("s1_x s1_y s1_z s2", (), "or --axes xyz for taxels of three axes"),
        ("s1_x s1_y s1_z s2", ("--flip", "x"), "--flip needs --axes"),
    ],
)
def test_what_is_not_three_axes_is_one_sentence(
    names, options, sentence, tmp_path, capsys
):
    write(tmp_path / "in", names.split(), values().reshape(FRAMES, -1)[:, :4])
    out = str(tmp_path / "out")
    assert main(["import", "csv", str(tmp_path / "in"), "--out", out, *options]) == 2
    assert sentence in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("text", ["xy", "xxyz", "abc", ""])
def test_letters_that_are_no_axes_are_refused(text, tmp_path, capsys):
    with pytest.raises(SystemExit):
        main(["import", "csv", "x", "--out", str(tmp_path / "o"), "--axes", text])
    assert "must be x, y and z in some order" in capsys.readouterr().err


def test_shear_beyond_its_range_is_refused(tmp_path, capsys):
    three = values()
    three[30, 0, 0] = 40000
    names = [f"s{i + 1}_{a}" for i in range(TAXELS) for a in "xyz"]
    write(tmp_path / "in", names, three.reshape(FRAMES, -1))
    out = str(tmp_path / "out")
    folder = str(tmp_path / "in")
    assert main(["import", "csv", folder, "--out", out, "--axes", "xyz"]) == 2
    assert "shear reaches 40000 counts, and at most 32767" in capsys.readouterr().err
