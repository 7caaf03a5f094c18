"""The sentences that go with a model."""

from dataclasses import replace

import numpy as np
import pytest

import train
from edge.record.recording import load
from edge.record.saving import save
from train.model.pipeline import ContactClassifier
from train.notes import LEAK, coarseness, posture_accuracy, warnings


def warnings_with(fitted, words):
    """The warnings with some words."""
    return [line for line in warnings(fitted) if words in line]


def test_flattering_data_and_left_out_recordings_get_a_warning(
    recordings,
    make_touch,
    tmp_path,
):
    save(tmp_path / "still.npz", make_touch(seconds=0.0))
    save(tmp_path / "odd.npz", make_touch(labels={"category": "soft-fixed"}))
    paths = [str(recordings), str(tmp_path)]
    options = {"features": ["paper"], "projection": "pca", "window_s": 9.0}
    text = "\n".join(warnings(train.fit(paths, **options, jobs=1)))
    assert "warning: no contact above 150 counts, so counted as wrong: " in text
    assert "edge-classify thresholds" in text
    assert "recordings are skipped for lack of a label for object: " in text
    ends = "every recording ends within 1.59 s of the onset"
    assert f"the window of 9 s is too long: {ends}" in text


def refitted(recordings, folder, features, change):
    """The fit of recordings that a function of their place and themselves changes."""
    for i, path in enumerate(sorted(recordings.glob("*.npz"))):
        save(folder / path.name, change(i, load(path)))
    return train.fit(str(folder), features=[features], jobs=1, k=1, quick=True)


def test_joint_angles_that_leak_the_label_get_a_warning(recordings, tmp_path):
    """The arm stood elsewhere for each object: its angles tell all without a touch."""
    objects = sorted({load(path).labels["object"] for path in recordings.glob("*.npz")})

    def place(_, recording):
        angle = 0.3 * objects.index(recording.labels["object"])
        return replace(recording, joints=np.full_like(recording.joints, angle))

    fitted = refitted(recordings, tmp_path, "posture", place)
    assert posture_accuracy(fitted.dataset, "object") == 1.0
    (sentence,) = warnings_with(fitted, "warning: object")
    assert "at onset alone give 100.0% of the labels" in sentence


def test_joint_angles_common_to_objects_are_no_leak(recordings, tmp_path):
    """Every recording begins in a pose that one of another object has too, and no
    other."""

    def place(i, recording):
        return replace(recording, joints=0.0 * recording.joints + i % 8)

    fitted = refitted(recordings, tmp_path, "posture", place)
    assert posture_accuracy(fitted.dataset, "object") == 0.0 < LEAK
    assert warnings_with(fitted, "warning: object: the joint angles") == []


def test_a_trial_so_far_outside_that_the_others_hardly_differ_is_named(
    recordings,
):
    """A skin that was stored with a scale of its own: one trial of newtons a million
    times too many leaves a few steps for all others."""
    fixed = {"projection": "pca", "scaling": "none", "jobs": 1, "k": 1}
    fitted = train.fit(str(recordings), features=["paper"], components=5, **fixed)
    assert warnings_with(fitted, "steps") == []
    outlier = fitted.X.copy()
    outlier[7] *= 3e6
    dataset = fitted.dataset
    classifier = ContactClassifier(fitted.classifier.choices, dataset.names)
    classifier.fit(outlier, {task: dataset.labels(task) for task in fitted.chosen})
    sentences = warnings_with(
        replace(fitted, classifier=classifier, X=outlier), "steps"
    )
    assert len(sentences) == len(fitted.chosen)
    path = dataset.trials[7].path
    assert f"because {path} lies far outside all others" in sentences[0]


@pytest.mark.parametrize(
    ("rows", "steps"),
    [
        ([[0.0], [3.0], [10.0]], 3.0),
        ([[0.0], [0.0], [0.0], [10.0]], 0.0),  # others all the same, on the grid
        ([[0.0, 0.0], [6.0, 8.0]], 10.0),
        ([[5.0]], np.inf),
    ],
)
def test_coarseness_is_the_median_gap_of_neighbours_in_units(rows, steps):
    assert coarseness(0.5 * np.array(rows), 0.5) == steps


def test_angles_in_degrees_name_some_recordings_and_count_the_others(fitted):
    trials = []
    for trial in fitted.measured.trials:
        joints = np.degrees(trial.recording.joints)
        trials.append(replace(trial, recording=replace(trial.recording, joints=joints)))
    wrong = replace(fitted, measured=replace(fitted.measured, trials=tuple(trials)))
    assert len(warnings_with(wrong, "beyond its limits")) == 3
    (line,) = warnings_with(wrong, "further recordings with such joint angles")
    assert line.startswith(f"warning: {len(trials) - 3} ")
