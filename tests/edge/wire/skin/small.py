"""Small skins for tests to change, and the sentence for a mistake in one."""

from dataclasses import replace

import numpy as np
import pytest

from edge.errors import InputError
from edge.wire.skin import file as skinfile

CODY = skinfile.load(skinfile.shipped("cody"))
FIRST = CODY.buses[0]
CHIP = replace(CODY, buses=(replace(FIRST, chips=FIRST.chips[:1]),))
"""Cody's skin with its first chip alone, which has 4 x 3 taxels."""
PICTURE = np.random.default_rng(0).integers(0, 5000, (16, 24)).astype(np.uint16)
"""Random counts of its taxels."""

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


def one_chip(
    rows,
    cols,
    kind="block",
    skin="",
    signal="",
    bus="device = 1",
    at="address = 40, ",
):
    """A skin file of one chip that has all taxels, with further lines for its
    tables."""
    return f"""[skin]
rows = {rows}
cols = {cols}
{skin}
[signal]
{signal}
[[bus]]
{bus}
kind = "{kind}"
chips = [{{ {at}first = [0, 0], block = [{rows}, {cols}] }}]
"""


def mpr121(**more):
    """A skin file of one MPR121 with 3 x 4 electrodes."""
    return one_chip(3, 4, "mpr121", at="address = 0x5A, ", **more)


def mistake(text):
    """The one sentence that refuses a skin file."""
    with pytest.raises(InputError) as caught:
        skinfile.parse(text, "my/skin.toml")
    sentence = str(caught.value)
    assert sentence.startswith("my/skin.toml: ")
    assert "\n" not in sentence.removeprefix("my/skin.toml: not TOML")
    return sentence
