"""Errors a user can mend, and text that is safe to show."""


def printable(text: str) -> str:
    """Text for a terminal or a line of a log: what does not print stands as Python writes it.

    That holds for line breaks, escape sequences, controls that turn the direction of writing,
    and lone surrogates, which no encoding has.

    >>> printable("box\\x1b[2J")
    'box\\\\x1b[2J'
    """
    return "".join(c if c.isprintable() else repr(c)[1:-1] for c in text)


class EdgeError(Exception):
    """Whatever edge-classify reports on purpose; its text is one sentence for a person.

    What a file brings into the sentence, a name with a line break say, cannot break the line.
    """

    def __str__(self) -> str:
        return printable(super().__str__())


class InputError(EdgeError, ValueError):
<<<<<<< HEAD
    """A file, option or value that cannot be used; the sentence names it and the remedy.

    >>> import edge
    >>> try:
    ...     edge.load("touch.npz")
    ... except edge.InputError as error:
    ...     print(error)
    touch.npz: cannot be read: No such file or directory
    """
=======
    """A file, an option or a value that cannot be used; the sentence names it and the mend."""
>>>>>>> d1a3388 (Sinks never stop decisions: lines leave by bounded writers, counted where lost; the map is a log of decisions; one encoder for all that leaves)
