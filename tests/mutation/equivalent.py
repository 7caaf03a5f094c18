"""Changes of `make mutants` that no test can notice, because they change nothing, and why."""

EQUIVALENT: dict[tuple[str, str, str], str] = {
    (
        "edge/touch/contact.py",
        "256  ->  257",
        "",
    ): "the rows that a contact first has room for; more room is made where they are full",
    (
        "edge/runtime/joint_stream.py",
        "arrived > self._window_ends  ->  arrived >= self._window_ends",
        "",
    ): "the least delay is that of two windows together: which of them a line at the limit opens "
    "or ends changes nothing until a window later, by one line",
    (
        "edge/skin/bus_reader.py",
        "now() >= deadline  ->  now() > deadline",
        "",
    ): "a clock that stands at the deadline to the bit is past it at its next reading",
    (
        "edge/touch/region.py",
        "highest <= self._threshold  ->  highest < self._threshold",
        "",
    ): "a shortcut: a frame whose peak is the threshold has no taxel above it, which is found next",
    (
        "edge/i2c/serial_bus.py",
        "-1  ->  1",
        "len(messages[-1].buffer)",
    ): "a request and its answer are two messages: the last is the second",
}
"""{(file, "old  ->  new", a part of the line): the reason}."""
