"""The arm of a file that a user names, in either of the formats."""

import os
from pathlib import Path

from edge.errors import InputError
from edge.touch.arm import Chain


def read_arm(
    path: str | os.PathLike[str],
    base: str | None = None,
    tip: str | None = None,
) -> Chain:
    """The chain of a TOML file, or of a URDF file between two of its links.

    Raises:
        InputError: as `Chain.from_toml` and `Chain.from_urdf`; or links are given for a
            TOML file, or a link is missing for a URDF.
    """
    if Path(path).suffix.lower() in (".urdf", ".xml", ".xacro"):
        if base is None or tip is None:
            raise InputError(
                f"{path}: a URDF needs --base and --tip, the arm's first link and the "
                "link that carries the skin"
            )
        return Chain.from_urdf(path, base, tip)
    if base is not None or tip is not None:
        raise InputError(f"{path}: --base and --tip are for a .urdf file")
    return Chain.from_toml(path)
