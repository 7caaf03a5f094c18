"""JSON files of the workstation; a mistake in one gives a one-sentence error."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from edge.config import ConfigTable, decode_json, parse_json
from edge.files import parsing, read_bytes


def json_table(path: Path) -> ConfigTable:
    """The table in a JSON file, which is empty where there is no such file.

    Raises:
        InputError: the file cannot be read, or is no JSON table.
    """
    raw = parse_json(read_bytes(path), str(path)) if path.is_file() else {}
    return ConfigTable(raw, str(path))


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
