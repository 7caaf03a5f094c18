"""The checksum of a microcontroller's frames."""

from edge.bus.crc import crc16, sealed


def test_bytes_with_their_own_checksum_have_the_checksum_zero():
    data = bytes(range(100))
    assert crc16(sealed(data)) == 0


def test_each_flipped_bit_changes_the_checksum():
    data = bytes(range(10))
    for bit in range(80):
        number = int.from_bytes(data, "big") ^ 1 << bit
        assert crc16(number.to_bytes(10, "big")) != crc16(data)
