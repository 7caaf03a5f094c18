"""What a model file holds, read before ONNX Runtime is trusted with it.

The few fields of the ONNX protobuf (onnx.proto3) that show whether a file refers to nothing outside
itself, uses only the operators that an exported model has, and asks for no more work than the size
of the file accounts for: ONNX Runtime would follow a path to another file, run any operator that it
knows, and fill the memory with what a few nodes make of each other.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass, field

from edge.errors import InputError

OPERATORS = frozenset(
    "Add ArgMax Cast Concat CumSum Div Gather GatherElements GatherND Identity If Less LessOrEqual "
    "MatMul Max Mul Pad ReduceL2 ReduceMean ReduceMin ReduceSum ReduceSumSquare Round Slice Split "
    "Sqrt Squeeze Sub TopK Unsqueeze Where".split()
)
"""The operators, all of the standard domain, that an exported model may use; what each makes of
its inputs' shapes is said in `_Work`."""
EACH_BY_EACH = frozenset(
    "Add Cast Div Identity Less LessOrEqual Max Mul Round Sqrt Sub Where".split()
)
NO_LARGER = frozenset("CumSum Slice Split TopK".split())

GRAPH, OPSETS, METADATA, FUNCTIONS = 7, 8, 14, 25
"""Fields of a ModelProto."""
NODES, INITIALIZERS, INPUTS, OUTPUTS, SPARSE = 1, 5, 11, 12, 15
TAKES, GIVES, OPERATOR, ATTRIBUTES, DOMAIN = 1, 2, 4, 5, 7
NUMBER_OF_AN_ATTRIBUTE, GRAPH_OF_AN_ATTRIBUTE = 3, 6
TENSORS_OF_AN_ATTRIBUTE, GRAPHS_OF_AN_ATTRIBUTE = (5, 10), (6, 11)
DIMENSIONS, WHOLE_NUMBERS, NAME_OF_A_TENSOR, RAW, EXTERNAL_DATA, DATA_LOCATION = 1, 7, 8, 9, 13, 14
DEEPEST = 8
STEPS_PER_BYTE, LEAST_BYTES = 16, 1 << 20
"""A decision reads or writes at most so many numbers for each byte of the file, or of a mebibyte
where that is more. An exported model, whose weights are most of it, takes about one."""
STEPS_OF_A_NODE = 1024
"""What a node itself costs: about a microsecond."""
MOST_AXES = 16

Message = dict[int, list[int | memoryview]]
"""{field number: its values}: a number, or the bytes of a text or of a message within."""


@dataclass
class Contents:
    """Operators, metadata and opsets of a model file."""

    operators: set[tuple[str, str]] = field(default_factory=set)
    """(domain, operator)."""
    metadata: dict[str, str] = field(default_factory=dict)
    opsets: dict[str, int | memoryview] = field(default_factory=dict)
    """{domain: version}."""
    external: bool = False
    """A tensor's values lie in another file."""
    functions: bool = False
    """The model brings functions of its own."""
    graphs: list[int | memoryview] = field(default_factory=list)


def _varint(data: memoryview, at: int) -> tuple[int, int]:
    value = 0
    for shift in range(0, 70, 7):
        byte = data[at]
        at += 1
        value |= (byte & 0x7F) << shift
        if byte < 0x80:
            return value, at
    raise ValueError("a number of more than 64 bits")


def _message(value: int | memoryview) -> Message:
    """The fields of a protobuf message (protobuf.dev, Encoding)."""
    if isinstance(value, int):
        raise ValueError("a number where a message belongs")
    fields: Message = defaultdict(list)
    at = 0
    while at < len(value):
        key, at = _varint(value, at)
        size = {1: 8, 5: 4}.get(key & 7)
        if key & 7 == 0:
            number, at = _varint(value, at)
            fields[key >> 3].append(number)
            continue
        if key & 7 == 2:
            size, at = _varint(value, at)
        if size is None or at + size > len(value):
            raise ValueError("a field of no known kind, or one that runs past its message")
        fields[key >> 3].append(value[at : at + size])
        at += size
    return fields


def _text(message: Message, number: int) -> str:
    """The last of a field's values, as protobuf takes them; empty where there is none."""
    values = message.get(number, [b""])
    if isinstance(values[-1], int):
        raise ValueError("a number where a text belongs")
    return bytes(values[-1]).decode("utf-8")


def _graph(value: int | memoryview, out: Contents, depth: int) -> None:
    if depth > DEEPEST:
        raise ValueError("graphs nested too deep")
    graph = _message(value)
    tensors = list(graph.get(INITIALIZERS, ()))
    for node in map(_message, graph.get(NODES, ())):
        out.operators.add((_text(node, DOMAIN), _text(node, OPERATOR)))
        for attribute in map(_message, node.get(ATTRIBUTES, ())):
            for number in TENSORS_OF_AN_ATTRIBUTE:
                tensors += attribute.get(number, ())
            for number in GRAPHS_OF_AN_ATTRIBUTE:
                for inner in attribute.get(number, ()):
                    _graph(inner, out, depth + 1)
    for tensor in map(_message, tensors):
        out.external |= EXTERNAL_DATA in tensor or any(tensor.get(DATA_LOCATION, ()))


def _whole(values: Sequence[int | memoryview]) -> list[int]:
    """A repeated field of signed whole numbers, packed or not."""
    out = []
    for value in values:
        at = 0
        while isinstance(value, memoryview) and at < len(value):
            number, at = _varint(value, at)
            out.append(number)
        if isinstance(value, int):
            out.append(value)
    return [number - (number >> 63 << 64) for number in out]


def _names(message: Message, number: int) -> list[str]:
    return [_text({number: [value]}, number) for value in message.get(number, ())]


Shape = tuple[int, ...]


class _Work:
    """The most that one decision takes: shapes followed through a graph, each axis's length at most
    what it is here (Slice and TopK may give fewer).

    Its methods raise ValueError, KeyError or IndexError where the graph makes no sense or takes
    more than `steps`.
    """

    def __init__(self, steps: int) -> None:
        self._left = steps
        self._shapes: dict[str, Shape] = {}
        self._numbers: dict[str, list[int]] = {}
        """Values of the constants that may be axes or widths of a margin."""

    def graph(self, graph: Message) -> list[Shape]:
        """Follow a graph, or a branch of one.

        Returns:
            The shapes of its outputs.
        """
        if SPARSE in graph:
            raise ValueError("a sparse tensor may be of any size")
        for given in map(_message, graph.get(INPUTS, ())):
            tensor = _only(_only(given, 2), 1)
            axes = map(_message, _only(tensor, 2).get(1, ()))
            # One vector at a time: an axis without a length is the batch's.
            self._set(_text(given, 1), tuple(max(1, *_whole(axis.get(1, [1]))) for axis in axes))
        for tensor in map(_message, graph.get(INITIALIZERS, ())):
            name, shape = _text(tensor, NAME_OF_A_TENSOR), tuple(_whole(tensor.get(DIMENSIONS, ())))
            if name in self._shapes:  # an input, with a value where none is given
                self._set(name, _broadcast([shape, self._shapes[name]]))
                continue
            self._set(name, shape)
            raw = memoryview(tensor.get(RAW, [b""])[-1])  # type: ignore[arg-type]
            if len(raw) <= 8 * MOST_AXES:
                self._numbers[name] = [
                    int.from_bytes(raw[i : i + 8], "little", signed=True)
                    for i in range(0, len(raw), 8)
                ] or _whole(tensor.get(WHOLE_NUMBERS, ()))
        for node in map(_message, graph.get(NODES, ())):
            self._node(node)
        return [self._shapes[_text(out, 1)] for out in map(_message, graph.get(OUTPUTS, ()))]

    def _set(self, name: str, shape: Shape) -> None:
        if len(shape) > MOST_AXES or min(shape, default=0) < 0:
            raise ValueError("no shape")
        self._shapes[name] = shape

    def _spend(self, *shapes: Shape, each: int = 1) -> None:
        for shape in shapes:
            # One axis at a time, so that no number here grows beyond the limit's square.
            size = each
            for length in shape:
                size *= length
                if size > self._left and 0 not in shape:
                    raise ValueError("too much work")
            self._left -= size
        if self._left < 0:
            raise ValueError("too much work")

    def _node(self, node: Message) -> None:
        operator = _text(node, OPERATOR)
        names = _names(node, TAKES)
        taken = [self._shapes[name] for name in names if name]
        attributes = {_text(a, 1): a for a in map(_message, node.get(ATTRIBUTES, ()))}
        if len(attributes) < len(node.get(ATTRIBUTES, ())):
            raise ValueError("an attribute given twice")

        def attribute(name: str, default: int) -> int:
            message = attributes.get(name, {})
            return _whole(message.get(NUMBER_OF_AN_ATTRIBUTE, [default]))[-1]

        def axes(number: int) -> list[int]:
            return self._numbers[names[number]] if len(names) > number and names[number] else []

        each = 1
        first = taken[0]
        axis = attribute("axis", 0)
        made = [first] * len(node.get(GIVES, ()))
        if operator == "If":
            branches = []
            for name in ("then_branch", "else_branch"):
                outside = self._shapes.copy(), self._numbers.copy()
                self._spend((len(self._shapes),))
                branches.append(self.graph(_only(attributes[name], GRAPH_OF_AN_ATTRIBUTE)))
                self._shapes, self._numbers = outside
            if any(len(a) != len(b) for a, b in zip(*branches, strict=True)):
                raise ValueError("branches of different shapes")
            made = [_broadcast(pair) for pair in zip(*branches, strict=True)]
        elif operator == "MatMul":
            a, b = taken
            made = [(*_broadcast([a[:-2], b[:-2]]), a[-2], b[-1])]
            each = max(a[-1], b[-2])
        elif operator == "Gather":
            axis %= len(first)
            made = [first[:axis] + taken[1] + first[axis + 1 :]]
        elif operator == "GatherND":
            made = [taken[1][:-1] + first[attribute("batch_dims", 0) + taken[1][-1] :]]
        elif operator == "GatherElements":
            made = [taken[1]]
        elif operator == "Concat":
            length = sum(shape[axis] for shape in taken)
            joined = list(_broadcast(taken))
            joined[axis] = length
            made = [tuple(joined)]
        elif operator == "Pad":
            margins = axes(1)
            padded = axes(3) or list(range(len(first)))
            if len(margins) != 2 * len(padded):
                raise ValueError("margins of other axes")
            grown = list(first)
            for i, place in enumerate(padded):
                grown[place] += max(margins[i], 0) + max(margins[i + len(padded)], 0)
            made = [tuple(grown)]
        elif operator == "Unsqueeze":
            longer = len(first) + len(axes(1))
            lengths = iter(first)
            new = {place % longer for place in axes(1)}
            made = [tuple(1 if i in new else next(lengths) for i in range(longer))]
        elif operator == "Squeeze" or operator == "ArgMax" or operator.startswith("Reduce"):
            gone = [axis] if operator == "ArgMax" else axes(1)
            if attribute("noop_with_empty_axes", 0):
                raise ValueError("axes that mean nothing")
            gone = [place % len(first) for place in gone or range(len(first))]
            left = operator != "Squeeze" and attribute("keepdims", 1)
            made = [
                tuple(1 if i in gone else n for i, n in enumerate(first) if left or i not in gone)
            ]
        elif operator in EACH_BY_EACH:
            made = [_broadcast(taken)]
        elif operator not in NO_LARGER:
            raise ValueError("an operator without a rule")
        self._spend((STEPS_OF_A_NODE,), *taken)
        self._spend(*made, each=each)
        for name, shape in zip(_names(node, GIVES), made, strict=True):
            self._set(name, shape)


def _only(message: Message, number: int) -> Message:
    """The only message of a field: protobuf would merge several into one."""
    [value] = message[number]
    return _message(value)


def _broadcast(shapes: Sequence[Shape]) -> Shape:
    """The shape that arrays of these have together."""
    most = max(map(len, shapes))
    rows = [(1,) * (most - len(shape)) + shape for shape in shapes]
    return tuple(max(column) for column in zip(*rows, strict=True))


def read(data: bytes) -> Contents:
    """Walk a model file.

    Raises:
        ValueError: it is not a protobuf message of that form.
    """
    out = Contents()
    try:
        model = _message(memoryview(data))
        out.functions = FUNCTIONS in model
        for opset in map(_message, model.get(OPSETS, ())):
            out.opsets[_text(opset, 1)] = opset.get(2, [0])[-1]
        for entry in map(_message, model.get(METADATA, ())):
            out.metadata[_text(entry, 1)] = _text(entry, 2)
        out.graphs = model.get(GRAPH, [])
        for graph in out.graphs:
            _graph(graph, out, 0)
    except IndexError:
        raise ValueError("a number runs past its message") from None
    return out


def check(data: bytes, name: str) -> Contents:
    """Walk a model file and refuse what an exported model never has.

    Raises:
        InputError: one sentence that names the file.
    """
    try:
        contents = read(data)
    except ValueError:
        contents = Contents()
    if not contents.operators or not contents.opsets:
        raise InputError(f"{name}: not an ONNX model; copy or export it again")
    if contents.external:
        raise InputError(f"{name}: its weights lie in another file; a model must be one file")
    foreign = sorted(
        f"{domain}.{operator}" if domain else operator
        for domain, operator in contents.operators
        if domain not in ("", "ai.onnx") or operator not in OPERATORS
    )
    if foreign or contents.functions:
        what = f"operator {foreign[0]}" if foreign else "functions of its own"
        raise InputError(f"{name}: has {what}, which no exported model uses; export it again")
    try:
        [graph] = map(_message, contents.graphs)
        _Work(STEPS_PER_BYTE * max(len(data), LEAST_BYTES)).graph(graph)
    except (ArithmeticError, LookupError, TypeError, ValueError):
        raise InputError(
            f"{name}: its graph contradicts itself, or a decision of it takes more than a model of "
            "its size can need; export it again"
        ) from None
    return contents
