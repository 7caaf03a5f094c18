"""Arrays: which axis is the time, trials within a file, and sizes."""

import numpy as np
import pytest
from scipy.io import savemat

from edge.errors import InputError
from train.importers.forms import arrays
from train.importers.forms.arrays import read_arrays, table_of, trials_of
from train.importers.forms.file import File
from train.importers.options import TableOptions

OPTIONS = TableOptions()
FRAMES = np.arange(24).reshape(6, 4)


@pytest.mark.parametrize(
    ("stored", "sentence"),
    [
        ({"a": np.ones((6, 6)), "b": np.ones((6, 2))}, "which axis of a"),
        ({"a": np.ones((6, 4)), "b": np.ones((5, 3))}, "which axis is the time"),
        ({"t": np.ones(7), "a": np.ones((6, 4))}, "is the time of 7 frames"),
        ({"a": np.ones((6, 4, 2, 2))}, "has 4 dimensions"),
        ({"": np.ones((3, 6, 2))}, "arrays are {'the array'"),
        (
            {"a": np.array([1, "x"], dtype=object)},
            "holds no values.*structures, give --trials",
        ),
        ({"a": FRAMES, "a.1": FRAMES[:, 0]}, "two columns are named a.1; rename one"),
    ],
)
def test_what_would_be_guessed_is_asked(stored, sentence):
    with pytest.raises(InputError, match=sentence):
        table_of("a.mat", stored, OPTIONS)


def test_an_axis_that_is_named_is_taken():
    square = np.arange(36).reshape(6, 6)
    stored = {"a": square, "b": np.ones((6, 2))}
    options = TableOptions(axis=2, taxels="a")
    table = table_of("a.mat", stored, options)
    assert table.data.to_numpy().tolist() == square.T.tolist()


def test_the_array_that_is_named_as_the_time_tells_the_frames():
    stored = {"clock": np.arange(6.0), "a": np.ones((6, 4)), "b": np.ones((4, 6))}
    options = TableOptions(time="clock")
    assert len(table_of("a.mat", stored, options).data) == 6


def of_structures(path):
    trials = np.zeros(2, dtype=[("frames", "O"), ("label", "O"), ("camera", "O")])
    camera = {"maker": "x", "lens": np.arange(3)}
    trials[0] = (FRAMES, "cup", camera)
    trials[1] = (FRAMES + 1, "pen", camera)
    savemat(path, {"trials": trials})


def of_cells(path):
    cells = np.empty(2, dtype=object)
    cells[0] = FRAMES
    cells[1] = FRAMES + 1
    savemat(path, {"frames": cells, "label": np.array(["cup", "pen"], dtype=object)})


def stacked(path):
    frames = np.stack([FRAMES, FRAMES + 1])
    savemat(path, {"frames": frames, "label": np.array(["cup", "pen"], dtype=object)})


def of_groups(path):
    h5py = pytest.importorskip("h5py")
    with h5py.File(path, "w") as file:
        for name, frames, label in ("1", FRAMES, "cup"), ("2", FRAMES + 1, "pen"):
            file[f"trials/{name}/frames"] = frames
            file[f"trials/{name}/label"] = np.array([label], dtype="S")


def of_cells_in_matlab_7_3(path):
    """As MATLAB writes them: columns first, characters as numbers, cells elsewhere."""
    h5py = pytest.importorskip("h5py")
    columns = {"frames": [FRAMES, FRAMES + 1], "label": ["cup", "pen"]}
    with h5py.File(path, "w") as file:
        for name, cells in columns.items():
            references = []
            for i, cell in enumerate(cells):
                is_text = isinstance(cell, str)
                stored = [[ord(letter)] for letter in cell] if is_text else cell.T
                part = file.create_dataset(f"#refs#/{name}{i}", data=stored)
                part.attrs["MATLAB_class"] = np.bytes_("char" if is_text else "double")
                references.append([part.ref])
            shape = file.create_dataset(name, data=references, dtype=h5py.ref_dtype)
            shape.attrs["MATLAB_class"] = np.bytes_("cell")


def trials_in(path):
    """The labels and the frames of the trials of a file."""
    trials = list(trials_of(read_arrays(File(path)), "object"))
    assert {name for _, arrays in trials for name in arrays} == {"frames"}
    frames = [arrays["frames"].tolist() for _, arrays in trials]
    assert frames == [FRAMES.tolist(), (FRAMES + 1).tolist()]
    return [labels for labels, _ in trials]


@pytest.mark.parametrize(
    "write",
    [
        of_structures,
        of_cells,
        of_cells_in_matlab_7_3,
        of_groups,
        stacked,
    ],
)
def test_trials_are_cells_structures_groups_or_a_first_axis(tmp_path, write):
    in_hdf5 = write in (of_cells_in_matlab_7_3, of_groups)
    path = tmp_path / ("a.h5" if in_hdf5 else "a.mat")
    write(path)
    assert trials_in(path) == [{"object": "cup"}, {"object": "pen"}]


def test_arrays_with_other_numbers_of_trials_are_named():
    stored = {"a": np.ones((2, 3)), "b": np.array(1.0)}
    with pytest.raises(InputError, match="{'a': 2, 'b': 1} trials; leave out"):
        list(trials_of(stored, "object"))


def file_of(path, array):
    """A file of one array, packed where its format packs."""
    if path.suffix == ".npy":
        np.save(path, array)
    elif path.suffix == ".npz":
        np.savez_compressed(path, skin=array)
    elif path.suffix == ".mat":
        savemat(path, {"skin": array}, do_compression=True)
    else:
        h5py = pytest.importorskip("h5py")
        with h5py.File(path, "w") as file:
            file["skin"] = array
    return path


def test_an_empty_data_set_of_hdf5_is_left_out(tmp_path):
    h5py = pytest.importorskip("h5py")
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["hand/skin"] = FRAMES
        file["note"] = h5py.Empty("f")
    assert list(table_of("", read_arrays(File(tmp_path / "a.h5")), OPTIONS).arrays) == [
        "hand.skin"
    ]


@pytest.mark.parametrize("suffix", [".npy", ".npz", ".mat", ".h5"])
def test_what_would_fill_the_memory_is_refused_before(tmp_path, suffix, monkeypatch):
    path = file_of(tmp_path / f"a{suffix}", np.zeros((100, 100), np.uint8))
    monkeypatch.setattr(arrays, "MOST_VALUES", 5000)
    with pytest.raises(InputError, match="values, more than the 5000 that are read"):
        read_arrays(File(path))
