"""Tables of three axes: which column is which axis of which taxel, signs, and what is
refused."""

from functools import partial

import numpy as np
import pytest

from tests.train.importers import test_csv
from train.importers.axes import lettered

FRAMES = 60
TAXELS = 4
TIME = 0.01 * np.arange(FRAMES)
RNG = np.random.default_rng(3)
THREE = RNG.integers(-900, 900, (FRAMES, TAXELS, 3))
"""Whole numbers x, y, z; z is pressed from frame 20 on."""
THREE[..., 2] = RNG.integers(200, 2000, (FRAMES, TAXELS))
THREE[:20] = 0


def named(form="s{i}_{a}", axes="xyz"):
    return [form.format(i=i + 1, a=a) for i in range(TAXELS) for a in axes]


def write_table(folder, names, values=THREE):
    lines = [",".join(["t", *names])]
    for t, row in zip(TIME, values.reshape(FRAMES, -1), strict=True):
        lines.append(",".join([f"{t:.2f}", *map(str, row[: len(names)])]))
    (folder / "cup_1.csv").write_text("\n".join(lines) + "\n")


def columns_in_another_order(folder):
    order = RNG.permutation(3 * TAXELS)
    names = [named()[i] for i in order]
    write_table(folder, names, THREE.reshape(FRAMES, -1)[:, order])


def three_arrays(folder):
    arrays = {a: THREE[..., i] for i, a in enumerate("xyz")}
    np.savez(folder / "cup_1.npz", t=TIME, **arrays)


def an_array_whose_last_axis_is_three(folder):
    np.savez(folder / "cup_1.npz", t=TIME, tactile=THREE)


@pytest.fixture
def imported(folder):
    """The function that imports the folder with some options."""
    return lambda *options: test_csv.imported(folder, *options)[1]["cup_1"]


@pytest.mark.parametrize(
    ("name", "letter", "plain"),
    [
        ("s1_x", "x", "s1"),
        ("s12Z", "z", "s12"),
        ("Fx_1", "x", "F1"),
        ("y.3", "y", "3"),
        ("taxel_0_3_z", "z", "taxel_0_3"),
    ],
)
def test_a_name_tells_its_axis_and_its_taxel(name, letter, plain):
    assert lettered(name) == (letter, plain)


@pytest.mark.parametrize("name", ["s1", "index", "x"])
def test_other_names_have_no_axis(name):
    assert lettered(name) is None


@pytest.mark.parametrize(
    ("write", "options", "sign"),
    [
        (partial(write_table, names=named()), ("xyz",), 1),
        (columns_in_another_order, ("xyz",), 1),
        (three_arrays, ("xyz",), 1),
        (an_array_whose_last_axis_is_three, ("xyz",), 1),
        # Here x is the normal, y runs along the rows, and z around the columns.
        (partial(write_table, names=named(axes="yzx")), ("yzx", "--flip", "yz"), -1),
    ],
)
def test_each_axis_arrives_in_its_place(write, options, sign, folder, imported):
    write(folder)
    recording = imported("--axes", *options)
    assert recording.frames[:, 0].tolist() == THREE[..., 2].tolist()
    assert recording.shear[:, 0].tolist() == (sign * THREE[..., :2]).tolist()
    assert recording.layout.axes == 3


@pytest.mark.parametrize(
    ("names", "options", "sentence"),
    [
        ("s1_x s1_y s1_z s2_z", ("--axes", "xyz"), "['s2'] lacks one of the axes"),
        ("s1_x s1_y s1_z s1_X", ("--axes", "xyz"), "s1_x and s1_X are both x of s1"),
        ("s1 s2 s3 s4", ("--axes", "xyz"), "no columns are named by an axis"),
        ("s1_x s1_y s1_z s2", (), "or --axes xyz for taxels of three axes"),
        ("s1_x s1_y s1_z s2", ("--flip", "x"), "--flip needs --axes"),
    ],
)
def test_what_is_not_three_axes_is_one_sentence(
    names,
    options,
    sentence,
    folder,
    refused,
):
    write_table(folder, names.split())
    assert sentence in refused("csv", folder, *options)


@pytest.mark.parametrize(("shear", "scale"), [(40000.0, "0.819175"), (0.25, "100")])
def test_shear_beyond_its_range_or_with_fractions_is_refused(
    folder, refused, shear, scale
):
    values = THREE // 10.0
    values[30, 0, 0] = shear
    write_table(folder, named(), values)
    message = refused("csv", folder, "--axes", "xyz")
    assert f"of shear to 32767); add --scale {scale}, or" in message


def test_taxels_of_three_axes_are_taken_beside_their_magnitudes(folder, imported):
    magnitudes = np.abs(THREE).sum(axis=2, keepdims=True)
    names = named("s{i}{a}", ("_x", "_y", "_z", ""))
    write_table(folder, names, np.concatenate([THREE, magnitudes], axis=2))
    recording = imported("--axes", "xyz")
    assert recording.frames[:, 0].tolist() == THREE[..., 2].tolist()
