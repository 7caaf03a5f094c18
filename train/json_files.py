"""JSON files of the workstation; a mistake in one gives a one-sentence error."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from edge.config import decode_json, parse_json
from edge.files import parsing, read_bytes


def read_json(path: str | os.PathLike[str]) -> Any:
    """The value of a JSON file; see `edge.config.parse_json`.

    Raises:
        InputError: it cannot be read, or is not JSON.
    """
    return parse_json(read_bytes(path), os.fspath(path))


@contextmanager
def json_file(path: str | os.PathLike[str], kind: str, mend: str) -> Iterator[Any]:
    """The value of a JSON file, for a block that takes it apart.

    Raises:
        InputError: the file cannot be read; or it is not JSON, or the block failed, as
            it does at a missing key or a wrong type. The message then says that the
            file is not `kind`, and ends with the remedy `mend`.
    """
    with parsing(os.fspath(path), kind, f"; {mend}"):
        yield decode_json(read_bytes(path))
