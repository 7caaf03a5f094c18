"""An error is one line, whatever the file brings into it."""

import pytest

from edge.errors import EdgeError


@pytest.mark.parametrize(
    ("text", "printed"),
    [
        ("a: unknown key b\nc", "a: unknown key b\\nc"),
        ("tab\there, \x1b[31mred", "tab\\there, \\x1b[31mred"),
        ("Käse: 3 x 4 taxels", "Käse: 3 x 4 taxels"),
    ],
)
def test_what_does_not_print_is_written_out(text, printed):
    assert str(EdgeError(text)) == printed
