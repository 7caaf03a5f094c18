"""The usual decision points of a model."""

from types import SimpleNamespace

import numpy as np
import pytest

from train.choose.decision_points import usual_points
from train.choose.settings import Settings
from train.model.pipeline import Choice


@pytest.mark.parametrize(
    ("trials", "objects", "components", "points"),
    [
        (140, 18, 99, (0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0, 1.1, 1.2)),
        (2000, 18, 17, (0.2, 0.4, 0.6, 0.8, 1.0, 1.2)),
        # no more coordinates than discriminants
        (160, 120, 999, (0.2, 0.4, 0.6, 0.8, 1.0, 1.2)),
        (4000, 90, 89, (1.2,)),
    ],
)
def test_a_model_has_the_decision_points_that_keep_it_small(
    trials,
    objects,
    components,
    points,
):
    labels = np.array([f"object {i % objects}" for i in range(trials)])
    data = SimpleNamespace(
        trials=range(trials),
        names=("max_force",),
        widths=lambda samples: (150,),
        labels=lambda task: labels,
    )
    data.of = lambda names: data
    choice = Choice("IV", components, 3, "lda", features=("max_force",))
    settings = Settings(
        chosen={"object": SimpleNamespace(choice=choice)},
        folds=np.zeros(trials),
        without=[],
        candidates=(),
        window_s=1.2,
    )
    seconds, notes = usual_points(data, settings, 40)
    assert seconds == pytest.approx(points)
    assert [note.split(" decision points")[0] for note in notes] == (
        [] if len(points) == 11 else ["no" if len(points) == 1 else str(len(points))]
    )
