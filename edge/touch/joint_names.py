"""Joints by their names."""

from collections.abc import Sequence

from edge.errors import InputError


def joint_columns(names: Sequence[str], joints: Sequence[str]) -> list[int]:
    """The index of each joint of an arm among some names.

    >>> joint_columns(["wheel", "elbow", "shoulder"], ["shoulder", "elbow"])
    [2, 1]

    Raises:
        InputError: a joint is missing; the sentence names it and all names.
    """
    index = {name: i for i, name in enumerate(names)}
    missing = [name for name in joints if name not in index]
    if missing:
        raise InputError(
            f"no angle of the arm's joint{'s' if len(missing) > 1 else ''} "
            f"{', '.join(missing)}; there are {', '.join(names) or 'none'}"
        )
    return [index[name] for name in joints]
