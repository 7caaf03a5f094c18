"""Damage valid files: their bytes, words of a text, arrays of an archive, pieces of a
model.

Each function takes a valid file and a `Random` of hypothesis, which can so shrink the
damage.
"""

import io
import json
import re
import struct
import zipfile
from functools import cache

import numpy as np
import onnx
from onnx import numpy_helper

from edge.decide.onnx_file import DIGEST
from tests.conftest import sealed

WORDS = (
    *"0 -0 -1 1 2 255 65535 65536 2147483648 9223372036854775808".split(),
    *"1e400 -1e400 1e308 1e-308 5e-324 nan NaN inf Infinity -inf".split(),
    *"0x10 1_000 true null '' \"\" [] {} [[]] %s%n = , # é 𝄞 1979-05-27".split(),
    *'../../etc/passwd /dev/zero "\\ud800" "\\u0000" "\\u001b[2J"'.split(),
    *"&a; < ]]>".split(),
    *"\x00 \n \r \x85 \u2028 \t \x1b[31m \x9b2J \u202e \ufeff \ud800".split(" "),
    *("9" * 400, "9" * 5000, "a" * 70000, "]" * 50),
    *("[" * 3000, "{" * 3000, '{"a":' * 2000),
    *("\x1b]0;x\x07", "<!DOCTYPE x>", "2 0", "0 0 0 0"),
)
"""Words that have broken readers before, here and elsewhere."""
TOKENS = re.compile(r"[-+]?\d[\w.+-]*|\"(?:[^\"\\\n]|\\.)*\"|\w+|[\[\]{}()=,:<>/\n]")
NUMBERS = (0, 1, 2, *(2**n - 1 for n in (7, 8, 15, 16, 31, 32)), 0x80, 0x8000, 1 << 62)
TYPES = ("u1", "i2", ">u2", "f4", ">f8", "c16", "?", "U3", "S2", "M8[s]")
FLOATS = (np.nan, np.inf, -np.inf, 1e308, -1e308, 5e-324, 1e18, -1.0)


def of_bytes(data, draw):
    """Spans of bytes replaced, removed, repeated, inserted or cut off."""
    out = bytearray(data)
    for _ in range(draw.choice((1, 1, 2, 4, 16))):
        at = draw.randrange(len(out) + 1)
        span = draw.choice((1, 2, 4, 16, 256))
        size = draw.choice((1, 2, 4, 8))
        number = draw.choice(NUMBERS) % (1 << 8 * size)
        new = (
            bytes(byte ^ 1 << draw.randrange(8) for byte in out[at : at + 1]),
            b"",
            2 * bytes(out[at : at + span]),
            draw.randbytes(min(span, 16)),
            number.to_bytes(size, draw.choice(("little", "big"))),
            draw.choice(WORDS).encode("utf-8", "surrogatepass")[:5000],
        )
        chosen = draw.choice(new)
        out[at : at + draw.choice((0, len(chosen), span))] = chosen
    return bytes(
        out[: draw.randrange(len(out) + 1)] if draw.randrange(10) == 9 else out
    )


def of_text(data, draw):
    """Words replaced by hostile ones or by others of the text, removed or repeated."""
    if draw.randrange(7) == 6:
        return of_bytes(data, draw)
    text = data.decode("utf-8", "surrogateescape")
    for _ in range(draw.choice((1, 1, 1, 2, 3))):
        places = [match.span() for match in TOKENS.finditer(text)]
        if not places:
            break
        (a, b), (c, d) = draw.choice(places), draw.choice(places)
        word = draw.choice(WORDS)
        if text[a] == '"':
            word = draw.choice((word, json.dumps(word)))
        repeated = text[min(a, c) : max(b, d)][:2000] + text[a:b]
        text = text[:a] + draw.choice((word, word, text[c:d], "", repeated)) + text[b:]
    return text.encode("utf-8", draw.choice(("surrogatepass", "replace")))


def of_array(array, draw):
    """Another type, shape or value; a text is damaged as a text."""
    if array.dtype.kind == "U" and array.size == 1 and draw.randrange(5):
        text = of_text(str(array.item()).encode(), draw)
        return np.array(text.decode("utf-8", "surrogateescape"))
    rows = np.atleast_1d(array)
    changed = rows.copy()
    where = [draw.randrange(changed.size + 1) for _ in range(draw.choice((1, 3, 100)))]
    inside = [i for i in where if i < changed.size]
    if array.dtype.kind == "f":
        with np.errstate(over="ignore"):  # a float32 becomes infinite
            changed.reshape(-1)[inside] = draw.choice(FLOATS)
    elif array.dtype.kind in "ui":
        limits = np.iinfo(array.dtype)
        changed.reshape(-1)[inside] = draw.choice((limits.min, limits.max, 0))
    kind = draw.choice(TYPES) if array.dtype.kind in "buif" else "S2"
    with np.errstate(all="ignore"):
        shapes = [
            changed,
            changed,
            np.zeros(3),
            rows.astype(kind),
            rows.reshape(-1),
            rows[None],
            rows[: draw.randrange(len(rows) + 1)],
            np.swapaxes(rows, 0, -1),
            rows[..., :0],
            np.concatenate([rows] * draw.choice((2, 20))),
        ]
    return draw.choice(shapes)


def npy(array, draw):
    """The array as an .npy file, whose header is damaged at times."""
    file = io.BytesIO()
    np.lib.format.write_array(file, np.asarray(array), allow_pickle=False)
    data = file.getvalue()
    way = draw.randrange(20)
    if way > 15:
        size = struct.unpack("<H", data[8:10])[0]
        header = of_text(data[10 : 10 + size], draw)[:65535]
        return data[:8] + struct.pack("<H", len(header)) + header + data[10 + size :]
    return of_bytes(data, draw) if way == 15 else data


@cache
def bomb():
    """64 MB of zeros as an .npy file."""
    file = io.BytesIO()
    np.save(file, np.zeros(1 << 26, np.uint8))
    return file.getvalue()


def of_npz(data, draw):
    """An array of the archive changed, renamed, exchanged or left out; at times the
    bytes."""
    if draw.randrange(5) == 4:
        return of_bytes(data, draw)
    with np.load(io.BytesIO(data), allow_pickle=False) as loaded:
        arrays = {key: loaded[key] for key in loaded.files}
    out = io.BytesIO()
    # Stored, mostly; deflated, BZIP2, LZMA.
    method = draw.choice((0, 0, 0, 0, 0, 0, 8, 12, 14))
    with zipfile.ZipFile(out, "w", method) as archive:
        if draw.randrange(100) == 99:
            archive.writestr("more.npy", bomb(), zipfile.ZIP_DEFLATED)
        key = draw.choice(sorted(arrays))
        array = arrays.pop(key)
        way = draw.randrange(8)
        names = (key, f"{key}.txt", f"../{key}.npy", f"{key}\x1b.npy")
        if way == 6 and arrays:
            array = arrays[draw.choice(sorted(arrays))]
        if way != 7:
            name = draw.choice(names) if way == 5 else f"{key}.npy"
            archive.writestr(
                name, npy(of_array(array, draw) if way < 5 else array, draw)
            )
        for name, array in arrays.items():
            archive.writestr(f"{name}.npy", npy(array, draw))
    return out.getvalue()


def of_onnx(data, draw):
    """Metadata, operators, attributes, edges or constants changed; at times the
    bytes."""
    if draw.randrange(3) == 2:
        return of_bytes(data.partition(DIGEST)[0], draw)
    model = onnx.load_from_string(data)
    graph = model.graph
    node = draw.choice(graph.node)
    constant = draw.choice(graph.initializer)
    way = draw.randrange(10)
    if way < 4:
        prop = draw.choice(model.metadata_props)
        prop.value = of_text(prop.value.encode(), draw).decode("utf-8", "replace")
    elif way == 4:
        node.op_type = _operator(graph, draw)
    elif way == 5 and node.input:
        node.input[draw.randrange(len(node.input))] = _input(graph, draw)
    elif way == 6 and node.attribute:
        draw.choice(node.attribute).i = draw.choice((-1, 0, 1, 7, 1 << 40))
    elif way == 7:
        _reshape(constant, draw)
    elif way == 8:
        _exchange(constant, draw)
    else:
        model.opset_import[0].version = draw.choice((0, 1, 7, 17, 21, 999))
    return sealed(model)


def _operator(graph, draw):
    """An operator of the graph, or another that ONNX has."""
    operators = [node.op_type for node in graph.node]
    return draw.choice(["Loop", "Exp", "Identity", *operators])


def _input(graph, draw):
    """The name of a constant, of the graph's input, or of nothing."""
    constants = [constant.name for constant in graph.initializer]
    return draw.choice([*constants, "features", "", "nowhere"])


def _reshape(constant, draw):
    """Give a constant another shape."""
    constant.dims[:] = [draw.choice((0, 1, 3, 1 << 33)) for _ in constant.dims]


def _exchange(constant, draw):
    """Damage a constant as an array."""
    array = of_array(numpy_helper.to_array(constant), draw)
    if array.dtype.kind in "uif" and array.dtype.isnative:
        constant.CopyFrom(numpy_helper.from_array(array, constant.name))
