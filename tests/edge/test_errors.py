"""An error is one line, whatever the file brings into it."""

import pytest

from edge.errors import EdgeError, InputError


@pytest.mark.parametrize("kind", [EdgeError, InputError])
@pytest.mark.parametrize(
    ("given", "shown"),
    [
        ("a: unknown key b\nc", "a: unknown key b\\nc"),
        ("tab\there, \x1b[31mred", "tab\\there, \\x1b[31mred"),
        ("Käse: 3 x 4 taxels", "Käse: 3 x 4 taxels"),
    ],
)
def test_what_does_not_print_is_written_out(kind, given, shown):
    assert str(kind(given)) == shown
