"""A category is softness by mobility."""

from edge.labels import CATEGORY, plain

WHOLE = {"category": "soft-fixed", "softness": "soft", "mobility": "fixed"}


def test_labels_follow_from_a_category_and_the_reverse():
    assert CATEGORY.completed({"category": "soft-fixed"}) == WHOLE
    assert CATEGORY.completed({"softness": "soft", "mobility": "fixed"}) == WHOLE


def test_labels_from_which_nothing_follows_are_left():
    for labels in ({"category": "none", "object": "cup"}, {"mobility": "fixed"}):
        assert CATEGORY.completed(labels) == labels
        assert CATEGORY.label(labels) is None


def test_a_label_that_a_person_gave_is_not_replaced():
    contradictory = {**WHOLE, "category": "rigid-fixed"}
    assert CATEGORY.completed(contradictory) == contradictory
    assert CATEGORY.label(contradictory) == "soft-fixed"


def test_what_a_model_could_not_hold_is_read_without_it_and_said(caplog):
    labels = {"object ": "tin\u00a0can", "softness": "\u200dsoft"}
    assert plain(labels, "a.npz") == {"object": "tin_can", "softness": "_soft"}
    assert caplog.text.count("a.npz: the labels") == 1
