"""Recompress a wheel with zopfli: the same contents in 3 % fewer bytes.

    python tests/board/recompress.py dist/edge_classify-*.whl

`make wheel` runs it. Every zip reader reads what zopfli writes, and the same contents
give the same bytes.
"""

import sys
import zipfile
from unittest import mock

from zopfli import zlib


class Zopfli:
    """Compresses the contents of one file, as an object of `zlib.compressobj` does."""

    def __init__(self, *_):
        self._data = b""

    def compress(self, data):
        """Take in contents."""
        self._data += data
        return b""

    def flush(self):
        """All of them, without the head and the checksum that zlib puts around."""
        return zlib.compress(self._data)[2:-4]


def main(wheel):
    """Write the wheel anew."""
    with zipfile.ZipFile(wheel) as archive:
        contents = [(info, archive.read(info)) for info in archive.infolist()]
    # The standard library has no public way to another compressor.
    with (
        mock.patch("zipfile._get_compressor", Zopfli),
        zipfile.ZipFile(wheel, "w") as archive,
    ):
        for info, data in contents:
            archive.writestr(info, data)


if __name__ == "__main__":
    main(sys.argv[1])
