"""Valid files made hostile: bytes, words of a text, members of an archive, parts of a model."""

from __future__ import annotations

import io
import json
import re
import struct
import zipfile
from functools import cache
from random import Random
from typing import Any

import numpy as np
import onnx
from numpy.typing import NDArray
from onnx import numpy_helper

WORDS = (
    *("0", "-0", "-1", "1", "2", "255", "65535", "65536", "2147483648", "9223372036854775808"),
    *("1e400", "-1e400", "1e308", "1e-308", "5e-324", "nan", "NaN", "inf", "Infinity", "-inf"),
    *("9" * 400, "9" * 5000, "0x10", "1_000", "true", "null", "''", '""', "[]", "{}", "[[]]"),
    *("[" * 3000, "{" * 3000, '{"a":' * 2000, "]" * 50, "\x00", "\n", "\r", "\x85", "\u2028"),
    *("\x1b[31m", "\x1b]0;x\x07", "\x9b2J", "\u202e", "\ufeff", "\ud800", '"\\ud800"', "é", "𝄞"),
    *("../../etc/passwd", "/dev/zero", "%s%n", "a" * 70000, "=", ",", "\t", "1979-05-27", "#"),
    *('"\\u0000"', '"\\u001b[2J"', "<!DOCTYPE x>", "&a;", "<", "]]>", "2 0", "0 0 0 0"),
)
"""What has broken readers before, here and elsewhere."""
TOKENS = re.compile(r"[-+]?\d[\w.+-]*|\"(?:[^\"\\\n]|\\.)*\"|\w+|[\[\]{}()=,:<>/\n]")
NUMBERS = (0, 1, 2, 0x7F, 0x80, 0xFF, 0x7FFF, 0x8000, 0xFFFF, 0x7FFFFFFF, 0xFFFFFFFF, 1 << 62)


def of_bytes(data: bytes, draw: Random) -> bytes:
    """Bits, bytes, words and spans changed, put in, taken out, cut off."""
    out = bytearray(data)
    for _ in range(draw.choice((1, 1, 2, 4, 16))):
        at = draw.randrange(len(out) + 1)
        span = draw.choice((1, 2, 4, 16, 256))
        match draw.randrange(7):
            case 0 if at < len(out):
                out[at] ^= 1 << draw.randrange(8)
            case 1:
                out[at : at + span] = draw.randbytes(min(span, 16))
            case 2:
                del out[at : at + span]
            case 3:
                out[at:at] = out[at : at + span]
            case 4:
                size = draw.choice((1, 2, 4, 8))
                number = draw.choice(NUMBERS) & ((1 << 8 * size) - 1)
                out[at : at + size] = number.to_bytes(size, draw.choice(("little", "big")))
            case 5 if draw.random() < 0.3:
                del out[at:]
            case 6:
                out[at:at] = draw.choice(WORDS[:60]).encode("utf-8", "surrogatepass")[:5000]
    return bytes(out)


def of_text(data: bytes, draw: Random) -> bytes:
    """Words replaced by others of the same text or by hostile ones; now and then bytes."""
    if draw.random() < 0.15:
        return of_bytes(data, draw)
    text = data.decode("utf-8", "surrogateescape")
    for _ in range(draw.choice((1, 1, 1, 2, 3))):
        places = [m.span() for m in TOKENS.finditer(text)]
        if not places:
            break
        a, b = draw.choice(places)
        c, d = draw.choice(places)
        match draw.randrange(5):
            case 0:
                text = text[:a] + draw.choice(WORDS) + text[b:]
            case 1:
                text = text[:a] + text[c:d] + text[b:]
            case 2:
                text = text[:a] + text[b:]
            case 3:
                text = text[:a] + text[min(a, c) : max(b, d)][:2000] + text[a:]
            case 4:
                quoted = text[a:b].startswith('"')
                word = draw.choice(WORDS)
                text = text[:a] + (json.dumps(word) if quoted else word) + text[b:]
    return text.encode("utf-8", "surrogatepass" if draw.random() < 0.5 else "replace")


def of_array(array: NDArray[Any], draw: Random) -> NDArray[Any]:
    """Another type, shape or value; JSON text within is mutated as text."""
    if array.dtype.kind == "U" and array.size == 1 and draw.random() < 0.8:
        text = of_text(str(array.reshape(())[()]).encode(), draw).decode("utf-8", "surrogateescape")
        return np.array(text)
    match draw.randrange(8):
        case 0:
            kind = draw.choice(("u1", "i2", ">u2", "f4", ">f8", "c16", "?", "U3", "S2", "M8[s]"))
            try:
                return array.astype(kind)
            except (TypeError, ValueError):
                return array.astype("S2")
        case 1:
            return array[: draw.randrange(len(array) + 1)] if array.ndim else array.reshape(1)
        case 2:
            return array.reshape(-1)
        case 3:
            return array[None]
        case 4:
            return np.swapaxes(array, 0, -1) if array.ndim else array.reshape(1, 1)
        case 5:
            return array[..., :0] if array.ndim else np.zeros(0)
        case 6:
            return np.concatenate([array] * draw.choice((2, 20))) if array.ndim else array
    if not array.size or array.dtype.kind not in "uif":
        return np.zeros(3)
    out = array.copy()
    flat = out.reshape(-1)
    where = [draw.randrange(flat.size) for _ in range(draw.choice((1, 3, 100)))]
    if array.dtype.kind == "f":
        flat[where] = draw.choice((np.nan, np.inf, -np.inf, 1e308, -1e308, 5e-324, 1e18, -1.0))
    else:
        limits = np.iinfo(array.dtype)
        flat[where] = draw.choice((limits.min, limits.max, 0))
    return out


def npy(array: NDArray[Any], draw: Random) -> bytes:
    """An array as a file of its own, its header damaged now and then."""
    file = io.BytesIO()
    np.lib.format.write_array(file, np.asarray(array), allow_pickle=False)
    data = file.getvalue()
    if draw.random() < 0.2:
        size = struct.unpack("<H", data[8:10])[0]
        header = of_text(data[10 : 10 + size], draw)[:65535]
        data = data[:8] + struct.pack("<H", len(header)) + header + data[10 + size :]
    elif draw.random() < 0.05:
        data = of_bytes(data, draw)
    return data


@cache
def bomb() -> bytes:
    """64 MB of zeros, deflated to 64 kB, as an array of uint8."""
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("x.npy", npy(np.zeros(1 << 26, np.uint8), Random(0)))
    return file.getvalue()


def of_npz(data: bytes, draw: Random) -> bytes:
    """Members changed, renamed, doubled, left out or put in; now and then the archive's bytes."""
    if draw.random() < 0.2:
        return of_bytes(data, draw)
    with np.load(io.BytesIO(data), allow_pickle=False) as loaded:
        arrays = {key: loaded[key] for key in loaded.files}
    chosen = draw.choice(sorted(arrays))
    out = io.BytesIO()
    kinds = [zipfile.ZIP_STORED] * 6 + [zipfile.ZIP_DEFLATED, zipfile.ZIP_BZIP2, zipfile.ZIP_LZMA]
    with zipfile.ZipFile(out, "w", draw.choice(kinds)) as archive:
        for key, array in arrays.items():
            name = f"{key}.npy"
            if key == chosen:
                match draw.randrange(8):
                    case 0:
                        continue
                    case 1:
                        name = draw.choice((key, f"{key}.txt", f"../{key}.npy", f"{key}\x1b.npy"))
                    case 2:
                        array = arrays[draw.choice(sorted(arrays))]
                    case _:
                        array = of_array(array, draw)
            archive.writestr(name, npy(array, draw))
    if draw.random() < 0.01:
        # A member that nobody asked for, a thousand times the size of the file.
        with zipfile.ZipFile(out, "a", zipfile.ZIP_DEFLATED) as archive:
            archive.writestr("more.npy", zipfile.ZipFile(io.BytesIO(bomb())).read("x.npy"))
    return out.getvalue()


def of_onnx(data: bytes, draw: Random) -> bytes:
    """Metadata, operators, attributes, edges, constants; now and then bytes."""
    if draw.random() < 0.3:
        return of_bytes(data, draw)
    model = onnx.load_from_string(data)
    graph = model.graph
    node = draw.choice(graph.node)
    constant = draw.choice(graph.initializer)
    match draw.randrange(10):
        case 0 | 1 | 2 | 3:
            prop = draw.choice(model.metadata_props)
            prop.value = of_text(prop.value.encode(), draw).decode("utf-8", "replace")
        case 4:
            others = ["Loop", "Exp", "Identity", *(n.op_type for n in graph.node)]
            node.op_type = draw.choice(others)
        case 5:
            if node.input:
                names = [*(i.name for i in graph.initializer), "features", "", "nowhere"]
                node.input[draw.randrange(len(node.input))] = draw.choice(names)
        case 6:
            if node.attribute:
                attribute = draw.choice(node.attribute)
                attribute.i = draw.choice((-1, 0, 1, 7, 1 << 40))
        case 7:
            constant.dims[:] = [draw.choice((0, 1, 3, 1 << 33)) for _ in constant.dims]
        case 8:
            array = of_array(numpy_helper.to_array(constant), draw)
            if array.dtype.kind in "uif" and array.dtype.isnative:
                constant.CopyFrom(numpy_helper.from_array(array, constant.name))
        case 9:
            model.opset_import[0].version = draw.choice((0, 1, 7, 17, 21, 999))
    return bytes(model.SerializeToString())
