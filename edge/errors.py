"""Errors a user can mend."""


class EdgeError(Exception):
    """Whatever edge-classify reports on purpose; its text is one sentence for a person.

    What a file brings into it, a name with a line break say, cannot break the line: all that
    does not print stands as Python writes it, `\\n`.
    """

    def __str__(self) -> str:
        text = super().__str__()
        return "".join(c if c.isprintable() else repr(c)[1:-1] for c in text)


class InputError(EdgeError, ValueError):
    """A file, an option or a value that cannot be used; the sentence names it and the mend."""
