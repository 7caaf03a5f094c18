"""Cells of a skin against plain sums over squares of taxels."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from edge.touch.cells import MOST_CELLS, Cells
from edge.touch.frame import Frame
from edge.touch.layout import SkinLayout


@pytest.mark.parametrize(
    ("shape", "side", "count"),
    [((16, 16), 1, 256), ((16, 24), 2, 96), ((1, 257), 2, 129), ((13, 13), 1, 169)],
)
def test_a_large_skin_is_pooled_in_squares_until_few_enough_are_left(shape, side, count):
    cells = Cells(SkinLayout(*shape))
    assert (cells.side, cells.count) == (side, count)
    assert count <= MOST_CELLS


@settings(max_examples=40)
@given(
    seed=st.integers(0, 1 << 32),
    shape=st.sampled_from([(3, 5), (16, 24), (17, 31), (1, 700)]),
)
def test_a_cell_is_the_sum_of_its_readable_taxels_and_dead_cells_are_left_out(seed, shape):
    rng = np.random.default_rng(seed)
    rows, cols = shape
    dead = rng.choice(rows * cols, size=rng.integers(0, rows * cols // 2), replace=False)
    layout = SkinLayout(rows, cols, dead=tuple(sorted(dead.tolist())))
    counts = rng.integers(0, 65536, shape).astype(np.uint16)
    valid = rng.random(shape) < 0.8
    cells = Cells(layout)
    expected = []
    for top in range(0, rows, cells.side):
        for left in range(0, cols, cells.side):
            square = [
                (r, c)
                for r in range(top, min(top + cells.side, rows))
                for c in range(left, min(left + cells.side, cols))
            ]
            if any(layout.alive[taxel] for taxel in square):
                expected.append(sum(int(counts[taxel]) for taxel in square if valid[taxel]))
    assert cells.read(Frame(0.0, counts, valid=valid)).tolist() == expected
    assert len(expected) == cells.count


def test_a_frame_that_says_nothing_of_validity_is_read_whole():
    cells = Cells(SkinLayout(2, 2))
    assert cells.read(Frame(0.0, np.array([[1, 2], [3, 65535]], dtype=np.uint16))).tolist() == [
        1,
        2,
        3,
        65535,
    ]
