"""An effect is added by a module and its entry in the schema, as CONTRIBUTING.md
shows."""

import re
import sys
from pathlib import Path

import numpy as np
import pytest

from tests.train.simulate.scenes import Rig
from train.simulate import effects, schema

TEXT = (Path(__file__).parents[3] / "CONTRIBUTING.md").read_text()
MODULE, ENTRY = re.findall(r"```python\n(.*?)```", TEXT, re.S)


@pytest.fixture
def sponge(tmp_path, monkeypatch):
    """The example of CONTRIBUTING.md, word for word."""
    (tmp_path / "sponge.py").write_text(MODULE)
    monkeypatch.setattr(effects, "__path__", [*effects.__path__, str(tmp_path)])
    before = dict(schema.OBJECT), dict(schema.EFFECTS)
    exec(ENTRY, vars(schema))
    yield
    for table, old in zip((schema.OBJECT, schema.EFFECTS), before, strict=True):
        table.clear()
        table.update(old)
    sys.modules.pop("train.simulate.effects.sponge", None)


@pytest.mark.usefixtures("sponge")
def test_a_sponge_under_a_steady_push_creeps_as_its_law_says():
    # F' = K (v - F / eta), so F = eta v (1 - exp(-K t / eta)), with arm and bed in
    # series.
    eta = np.array([20.0, 60.0])
    speed = 0.15
    stiffness = 1.0 / (1.0 / 115.0 + 1.0 / 1e4)
    trace = Rig(5e-4, effects=("sponge",), speed=speed, sponge_n_s_m=eta).run(2000)
    want = eta * speed * (1.0 - np.exp(-stiffness * trace.t / eta))
    np.testing.assert_allclose(trace.force, want, atol=2e-3 * want.max())
