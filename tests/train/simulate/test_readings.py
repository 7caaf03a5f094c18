"""Unloaded taxels are left out until an effect asks for them; frames hold whole counts."""

import numpy as np
import pytest

from tests.train.simulate.scenes import one_object, scene
from train.simulate.readings import FULL, Readings

FRAMES, ROWS, COLS = 3, 2, 4
SKIN = {"rows": ROWS, "cols": COLS}
SCENE = scene(one_object(), skin=SKIN, motion={"place_m": 0.18})


def reading(taxels, counts, kind=np.float32) -> Readings:
    return Readings(
        scene=SCENE,
        trial=None,
        effects=(),
        which=0,
        t=np.arange(FRAMES) / 100.0,
        counts=np.array(counts, dtype=kind).reshape(FRAMES, len(taxels)),
        taxels=np.array(taxels, dtype=np.intp),
        joints=np.zeros((FRAMES, 1)),
    )


@pytest.mark.parametrize("taxels", [[], [5, 2], [7, 6, 5, 4, 3, 2, 1, 0], list(range(8))])
def test_each_taxel_stands_at_its_place_on_the_skin(taxels):
    counts = 1.0 + np.arange(FRAMES * len(taxels)).reshape(FRAMES, len(taxels))
    want = np.zeros((FRAMES, ROWS * COLS))
    want[:, taxels] = counts
    want = want.reshape(FRAMES, ROWS, COLS)
    one = reading(taxels, counts)
    assert one.frames().dtype == np.uint16
    np.testing.assert_array_equal(one.frames(), want)
    whole = one.everywhere()
    np.testing.assert_array_equal(whole, want)
    whole[2, 1, 3] = 99.0  # what an effect does to it is what the next one finds
    assert one.everywhere()[2, 1, 3] == one.counts[2, 7] == one.frames()[2, 1, 3] == 99
    assert one.taxels.tolist() == list(range(8))


@pytest.mark.parametrize(
    ("count", "shown"), [(0.5, 0), (1.5, 2), (2.4, 2), (-3.0, 0), (FULL - 0.4, 65535), (1e9, 65535)]
)
def test_a_count_is_the_nearest_whole_one_that_the_converter_can_read(count, shown):
    assert reading([6], [0.0, count, 0.0]).frames()[1, 1, 2] == shown
