"""Errors a user can mend."""


class EdgeError(Exception):
    """Whatever edge-classify reports on purpose; its text is one sentence for a person."""


class InputError(EdgeError, ValueError):
    """A file, an option or a value that cannot be used; the sentence names it and the mend."""
