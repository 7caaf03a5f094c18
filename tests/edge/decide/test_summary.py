"""What a summary says, and a comparison of two."""

from edge.decide.summary import Summary, compared


def summed(*pairs):
    """A summary of one task: labels, and what was decided."""
    summary = Summary({"object": None})
    for number, (label, answer) in enumerate(pairs):
        event = {"event": "decision", "task": "object", "label": answer, "flags": []}
        summary.add({"object": label}, [event], str(number))
    return summary


def test_a_label_cannot_send_escape_sequences_to_the_terminal():
    text = summed(("\u202ebox\x9b", "\x1b]0;a\x07")).text()
    assert all(line.isprintable() for line in text.splitlines())
    assert "\\x1b]0;a\\x07" in text


def test_a_comparison_counts_what_is_gained_and_lost():
    first = summed(*[("a", "a")] * 4, *[("b", "a")] * 6)
    second = summed(*[("b", "a")] * 2, *[("a", "a")] * 8)
    text = compared("A", first, "B", second)
    assert "object: 6 gained, 2 lost of 10: +40.0 points" in text
    assert "favours" not in text
