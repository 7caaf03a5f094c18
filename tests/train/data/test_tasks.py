"""The tasks that are fitted."""

from types import SimpleNamespace

import numpy as np
import pytest

from edge.errors import InputError
from train.data.tasks import labels_of_tasks, lacking

LABELS = {"kind": np.array(["a", "b", "a"]), "room": np.array(["x", "", ""])}
DATASET = SimpleNamespace(tasks=("kind", "room"), labels=LABELS.get, trials=range(3))


def test_a_task_that_most_trials_lack_is_fitted_where_it_is_named():
    assert list(labels_of_tasks(DATASET, None)) == ["kind"]
    (sentence,) = lacking(DATASET, None)
    assert "task room is ignored: 1 of 3" in sentence
    assert list(labels_of_tasks(DATASET, ["room"])) == ["room"]
    assert lacking(DATASET, ["room"]) == []


def test_a_task_without_labels_is_refused():
    with pytest.raises(InputError, match="label 'place'; all have kind, room"):
        labels_of_tasks(DATASET, ["place"])
