"""A skin of 24 taxels on two chips, for tests to change."""

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
