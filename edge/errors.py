"""The base of all errors, and the errors that a user can correct."""


class EdgeError(Exception):
    """The base of the errors that edge-classify raises; its text is one sentence for a person.

    The text stays on one line whatever a file contributes to it: characters that cannot be
    printed are escaped as in Python, a line break as `\\n`.

    >>> import edge
    >>> try:
    ...     edge.Chain([]).pose([0.0])
    ... except edge.EdgeError as error:
    ...     print(error)
    the arm base to tip takes 0 joint angles (), not 1
    """

    def __str__(self) -> str:
        text = super().__str__()
        return "".join(c if c.isprintable() else repr(c)[1:-1] for c in text)


class InputError(EdgeError, ValueError):
    """A file, option or value that cannot be used; the sentence names it and the remedy.

    >>> import edge
    >>> try:
    ...     edge.load("touch.npz")
    ... except edge.InputError as error:
    ...     print(error)
    touch.npz: cannot be read: No such file or directory
    """
