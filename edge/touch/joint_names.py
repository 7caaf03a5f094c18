"""Joints by their names."""

from collections.abc import Sequence

from edge.errors import InputError


def joint_columns(given: Sequence[str], wanted: Sequence[str]) -> list[int]:
    """The index of each wanted joint among the given ones.

    >>> joint_columns(["wheel", "elbow", "shoulder"], ["shoulder", "elbow"])
    [2, 1]

    Raises:
        InputError: a joint is missing; the sentence names it and the given joints.
    """
    index = {name: i for i, name in enumerate(given)}
    missing = [name for name in wanted if name not in index]
    if missing:
        raise InputError(
            f"no angle of the arm's joint{'s' if len(missing) > 1 else ''} "
            f"{', '.join(missing)}; there are {', '.join(given) or 'none'}"
        )
    return [index[name] for name in wanted]
