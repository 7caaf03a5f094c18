"""Labels that are probably slips, and those that are none."""

import pytest

from edge.record import slips as module
from edge.record.slips import counts_text, slips


def trials(counts):
    """Trials with an object each, so many of each name."""
    return [{"object": name} for name, count in counts.items() for _ in range(count)]


def places(labels):
    return [f"{number}.npz" for number in range(len(labels))]


@pytest.mark.parametrize(
    ("meant", "label", "counts"),
    [
        ("box", "Box", (8, 1)),
        ("card board", "card-board", (8, 1)),
        ("pillow", "pilow", (8, 1)),
        # A short label is a slip of a far more frequent one.
        ("pen", "pem", (20, 2)),
        # Labels that differ in case alone are one, however frequent.
        ("box", "Box", (4, 4)),
    ],
)
def test_a_rare_label_that_is_spelled_like_a_frequent_one_is_named(
    meant,
    label,
    counts,
):
    labels = trials(dict(zip((meant, label), counts, strict=True)))
    where = ", ".join([*places(labels)[counts[0] :][:3], *["..."] * (counts[1] > 3)])
    sentence = (
        f"object={label!r}: is it {meant!r}? ({counts[1]} of {sum(counts)} recordings: "
        f"{where})"
    )
    assert slips(labels, places(labels)) == [sentence]


@pytest.mark.parametrize(
    "counts",
    [
        {"box 2": 8, "box 1": 2},  # numbers
        {"cap": 8, "cup": 2},  # short labels
        {"a": 30, "b": 2},  # letters
        {"hard": 8, "soft": 2},
        {"box": 1, "tree": 1},  # where every label has one trial, none is odd
    ],
)
def test_labels_that_are_meant_are_no_slips(counts):
    labels = trials(counts)
    assert slips(labels, places(labels)) == []


def test_a_label_with_one_trial_is_named():
    labels = trials({"box": 5, "tree": 1})
    (sentence,) = slips(labels, places(labels))
    assert sentence == "object='tree' stands alone (1 of 6 recordings: 5.npz)"


def test_a_task_that_nearly_all_trials_lack_is_named_with_what_is_meant():
    labels = [{"category": "soft-fixed"}] * 55 + [{"categroy": "soft-fixed"}]
    assert slips(labels, places(labels))[0] == (
        "task 'categroy': is it 'category'? (1 of 56 recordings: 55.npz)"
    )


def test_a_category_that_contradicts_softness_and_mobility_is_named():
    right = {"category": "soft-fixed", "softness": "soft", "mobility": "fixed"}
    wrong = {**right, "softness": "rigid"}
    labels = [right] * 9 + [wrong] * 3
    assert slips(labels, places(labels))[0] == (
        "category='soft-fixed' contradicts softness and mobility, which say "
        "'rigid-fixed' (3 of 12 recordings: 9.npz, 10.npz, 11.npz)"
    )


def test_each_task_has_a_line_of_its_labels_with_their_counts():
    labels = [{"object": "box", "who": "me"}, {"object": "box"}, {"object": "cup"}]
    assert counts_text(labels) == [
        "object (3 of 3): box 2, cup 1",
        "who (1 of 3): me 1",
    ]


def test_hundreds_of_labels_are_not_compared_with_each_other(monkeypatch):
    """That takes minutes where a file has thousands."""
    compared = []
    monkeypatch.setattr(module, "_alike", lambda *names: compared.append(names))
    labels = [{"object": "x" * i} for i in range(1, 502)]
    assert slips(labels, places(labels)) == []
    assert compared == []
