"""The step holds where others blow up. "Finite" proves nothing: forces and energy are
judged."""

import numpy as np

from train.simulate import contact


def test_taxels_bear_the_force_to_its_last_digits():
    """Stiffness times depth loses digits of stiff springs."""
    rng = np.random.default_rng(2)
    force = rng.uniform(0.0, 10.0, 200)
    loads = rng.uniform(0.0, 1.0, (7, 16, 200))
    contact.share_out(force, loads)
    np.testing.assert_allclose(loads.sum(axis=(0, 1)), force, rtol=1e-14)
