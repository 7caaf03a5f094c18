"""Recompress a wheel with zopfli: the same contents in 3 % fewer bytes.

    python tests/board/recompress.py dist/edge_classify-*.whl

`make wheel` runs it. Every zip reader reads what zopfli writes, and the same contents
give the same bytes.
"""

import sys
import zipfile

import zopfli


def main(wheel):
    """Write the wheel anew."""
    with zipfile.ZipFile(wheel) as archive:
        contents = [(info, archive.read(info)) for info in archive.infolist()]
    with zopfli.ZipFile(wheel, "w") as archive:
        for info, data in contents:
            archive.writestr(info, data, zipfile.ZIP_DEFLATED)


if __name__ == "__main__":
    main(sys.argv[1])
