"""The checksum of a microcontroller's frames and packets."""

from binascii import crc_hqx


def crc16(data: bytes) -> int:
    """CRC-16/CCITT-FALSE.

    >>> hex(crc16(b"123456789"))
    '0x29b1'
    """
    return crc_hqx(data, 0xFFFF)


def sealed(data: bytes) -> bytes:
    """Bytes with their CRC."""
    return data + crc16(data).to_bytes(2, "big")
