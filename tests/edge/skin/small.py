"""A skin of 24 taxels on two chips, for tests to change, and the sentence for a mistake in one."""

import pytest

from edge.errors import InputError
from edge.skin import file as skinfile

SMALL = """
[skin]
rows = 4
cols = 6

[signal]  # a comment that stays
sign = -1

[[bus]]
device = 1
kind = "ad7147"
mux = 0x70
block = [4, 3]
chips = [
  { channel = 0, address = 0x2C, first = [0, 0] },
  { channel = 0, address = 0x2D, first = [0, 3] },
]
"""


def mistake(text):
    """The one sentence that refuses a skin file."""
    with pytest.raises(InputError) as caught:
        skinfile.parse(text, "my/skin.toml")
    sentence = str(caught.value)
    assert sentence.startswith("my/skin.toml: ")
    assert "\n" not in sentence.removeprefix("my/skin.toml: not TOML")
    return sentence
