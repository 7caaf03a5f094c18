"""`run` notices that the model does not know the things that it meets."""

from edge.commands.run import FEWEST_TOUCHES, LAST_TOUCHES, UnknownTouches
from edge.events import Decided, Onset


def touch(number, unknown):
    flags = ("unknown",) if unknown else ()
    onset_s = float(number)
    answers = [
        Decided(task, "a", 1.0, 1.2, onset_s, 0.1, flags)
        for task in ("object", "softness")
    ]
    return [Onset(onset_s), *answers]


def test_most_touches_are_unknown_and_it_is_said_once_with_the_remedy(caplog):
    touches = UnknownTouches()
    heard = [touches.push(touch(i, unknown=i % 4)) for i in range(3 * LAST_TOUCHES)]
    events = [event for event in heard if event is not None]
    assert events == [
        {"event": "unknown_touches", "unknown": 6, "touches": FEWEST_TOUCHES}
    ]
    (sentence,) = caplog.messages
    assert sentence.endswith("label them, and export a model with them")


def test_half_of_the_touches_may_be_unknown_and_old_ones_are_forgotten():
    touches = UnknownTouches()
    for i in range(3 * LAST_TOUCHES):
        assert touches.push(touch(i, unknown=i % 2)) is None
    for i in range(LAST_TOUCHES):
        assert touches.push(touch(1000 + i, unknown=False)) is None
    due = [
        touches.push(touch(2000 + i, unknown=True)) is not None
        for i in range(LAST_TOUCHES)
    ]
    assert due.index(True) == LAST_TOUCHES // 2
