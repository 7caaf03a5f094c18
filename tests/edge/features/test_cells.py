"""Cells of a skin, and the tangential force on each."""

from itertools import product

import numpy as np
import pytest

from edge.features.cells import Cells, ShearCells
from edge.features.vector import feature_vector
from edge.touch.layout import SkinLayout
from tests.edge.features.test_zones import FLAT, frame_of
from tests.edge.touch.pressed import followed


@pytest.mark.parametrize(
    ("shape", "side"), [((16, 16), 1), ((1, 257), 2), ((17, 31), 2), ((1, 700), 4)]
)
def test_a_cell_is_the_sum_of_its_readable_taxels_and_dead_cells_are_left_out(
    shape, side
):
    rows, cols = shape
    dead = np.random.default_rng(cols).permutation(rows * cols)[: rows * cols // 2]
    layout = SkinLayout(rows, cols, dead=tuple(sorted(dead.tolist())))
    frame = frame_of(cols, shape, 1.0)
    assert Cells(layout).side == side
    corners = product(range(0, rows, side), range(0, cols, side))
    squares = [np.s_[row : row + side, col : col + side] for row, col in corners]
    living = [square for square in squares if layout.alive[square].any()]
    along, around = np.moveaxis(frame.shear, 2, 0)

    def sums(values):
        readable = values.astype(int) * frame.valid
        return [int(readable[square].sum()) for square in living]

    assert Cells(layout).read(frame).tolist() == sums(frame.counts)
    assert Cells(layout).width == len(living)
    assert ShearCells(layout).read(frame).tolist() == sums(along) + sums(around)
    assert ShearCells(layout).width == 2 * len(living)


def test_the_samples_of_each_cell_and_axis_stand_together():
    frames = [frame_of(seed, FLAT.shape) for seed in range(3)]
    for i, frame in enumerate(frames):
        object.__setattr__(frame, "t", 0.5 * i)
    series = followed(FLAT, frames, features=["taxel_shear"]).series()
    vector = feature_vector(series, 1.0, 3, ["sqrt_taxel_shear"])
    readable_forces = [
        (f.shear * f.valid[..., None] / 100.0).reshape(-1, 2) for f in frames
    ]
    expected = np.transpose(readable_forces, (2, 1, 0)).reshape(-1)
    assert (np.sign(vector) * vector**2).tolist() == pytest.approx(expected, rel=1e-15)
