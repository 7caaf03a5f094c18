"""The base of all errors, the errors that a user can correct, and text that is safe to
print."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager


def printable(text: str) -> str:
    """Text that is safe on a terminal or in a log: unprintable characters become Python
    escapes.

    These are line breaks, escape sequences, characters that reverse the direction of
    writing, and lone surrogates, which no encoding has.

    >>> printable("box\\x1b[2J")
    'box\\\\x1b[2J'
    """
    return "".join(c if c.isprintable() else repr(c)[1:-1] for c in text)


class EdgeError(Exception):
    """The base of the errors that edge-classify raises; its text is one sentence for a
    person.

    The text stays on one line, whatever the file that it quotes contains (see
    `printable`).

    >>> import edge
    >>> try:
    ...     edge.Chain([]).pose([0.0])
    ... except edge.EdgeError as error:
    ...     print(error)
    the arm takes 0 joint angles (), not an array (1,)
    """

    def __str__(self) -> str:
        return printable(super().__str__())


class InputError(EdgeError, ValueError):
    """A file, option or value that cannot be used; the sentence names it and the
    remedy.

    >>> import edge
    >>> try:
    ...     edge.load("touch.npz")
    ... except edge.InputError as error:
    ...     print(error)
    touch.npz: cannot be read: No such file or directory
    """


class OutOfRange(InputError):
    """Features that are too large to be scaled, or not finite: a decision on them has
    no label."""


@contextmanager
def about(name: str) -> Iterator[None]:
    """Begin the sentences of the errors in the block with the name of what they are
    about.

    Raises:
        InputError: the block raised one.
    """
    try:
        yield
    except InputError as error:
        raise InputError(f"{name}: {error}") from None


def counted(count: int, noun: str) -> str:
    """A count with its noun: "1 chip", "2 chips".

    >>> counted(1, "chip"), counted(2, "chip")
    ('1 chip', '2 chips')
    """
    return f"{count} {noun}{'s' * (count != 1)}"


MOST_PLACES = 6
"""Taxels that a line for a person names."""


def places_text(taxels: Sequence[Sequence[int]]) -> str:
    """The first taxels of some.

    >>> places_text([(3, 5), (0, 1)])
    '[3, 5], [0, 1]'
    """
    more = " ..." if len(taxels) > MOST_PLACES else ""
    return ", ".join(f"[{row}, {col}]" for row, col in taxels[:MOST_PLACES]) + more
