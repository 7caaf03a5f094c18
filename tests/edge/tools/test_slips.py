"""Labels that are probably slips, and those that are none."""

import pytest

from edge.tools.slips import counts_text, slips


def trials(**counts):
    """Trials with an object each, so many of each name."""
    return [{"object": name} for name, count in counts.items() for _ in range(count)]


@pytest.mark.parametrize(
    ("label", "meant"),
    [
        ("Box", "box"),
        ("box ", "box"),
        ("card-board", "card board"),
        ("pilow", "pillow"),
    ],
)
def test_a_rare_label_that_is_spelled_like_a_frequent_one_is_named(label, meant):
    labels = [{"object": meant}] * 8 + [{"object": label}]
    assert slips(labels) == [f"object={label!r} on 1 of 9 recordings; is it {meant!r}?"]


@pytest.mark.parametrize(
    ("label", "frequent"),
    [("box 1", "box 2"), ("cup", "cap"), ("soft", "hard"), ("chair", "table")],
)
def test_labels_that_differ_by_a_number_or_are_short_are_no_slips(label, frequent):
    labels = [{"object": frequent}] * 8 + [{"object": label}] * 2
    assert slips(labels) == []


@pytest.mark.parametrize(
    ("label", "meant"), [("pem", "pen"), ("bx", "box"), ("Tin", "tin")]
)
def test_a_short_label_is_a_slip_of_a_far_more_frequent_one(label, meant):
    labels = [{"object": meant}] * 20 + [{"object": label}] * 2
    assert slips(labels) == [
        f"object={label!r} on 2 of 22 recordings; is it {meant!r}?"
    ]


def test_letters_are_no_slips_of_each_other():
    assert slips(trials(a=30, b=2)) == []


def test_labels_that_differ_in_case_alone_are_one_however_frequent():
    assert slips(trials(box=4, Box=4)) == [
        "object='Box' on 4 of 8 recordings; is it 'box'?"
    ]


def test_a_label_with_one_trial_is_named():
    assert slips(trials(box=5, tree=1)) == ["object='tree' on a single recording"]


def test_where_every_label_has_one_trial_none_is_odd():
    assert slips(trials(box=1, tree=1, sofa=1)) == []


def test_a_task_that_nearly_all_trials_lack_is_named_with_what_is_meant():
    labels = [{"category": "soft-fixed"}] * 55 + [{"categroy": "soft-fixed"}]
    assert slips(labels)[0] == (
        "task 'categroy' on 1 of 56 recordings; is it 'category'?"
    )


def test_a_category_that_contradicts_softness_and_mobility_is_named():
    right = {"category": "soft-fixed", "softness": "soft", "mobility": "fixed"}
    wrong = {**right, "softness": "rigid"}
    assert slips([right] * 9 + [wrong] * 3)[0] == (
        "category contradicts softness and mobility on 3 of 12 recordings, such as "
        "'soft-fixed' beside 'rigid-fixed'"
    )


def test_each_task_has_a_line_of_its_labels_with_their_counts():
    labels = [{"object": "box", "who": "me"}, {"object": "box"}, {"object": "cup"}]
    assert counts_text(labels) == [
        "object (3 of 3): box 2, cup 1",
        "who (1 of 3): me 1",
    ]
