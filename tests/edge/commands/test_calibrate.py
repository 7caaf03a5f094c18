"""`edge-classify calibrate`: which taxels are restless."""

import numpy as np

from edge.commands.calibrate import RESTLESS, RESTLESS_COUNTS, restless


def test_a_taxel_is_restless_beyond_the_limit_and_not_at_it():
    noise = np.full((3, 4), 2.0)
    noise[0, 1] = RESTLESS * 2.0 + RESTLESS_COUNTS
    assert restless(noise) == []
    noise[2, 3], noise[1, 0] = noise[0, 1] + 1.0, noise[0, 1] + 9.0
    assert restless(noise) == [(1, 0), (2, 3)]
