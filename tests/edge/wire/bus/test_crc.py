"""The checksum of a microcontroller's frames."""

from edge.wire.bus.crc import crc16, sealed


def test_bytes_with_their_own_checksum_have_the_checksum_zero():
    data = bytes(range(100))
    assert crc16(sealed(data)) == 0
