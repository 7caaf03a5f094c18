"""The commands and drivers under a real Linux kernel's /dev/i2c-N, over modelled chips.

`make kernel-test` runs this: it boots a Debian kernel and runs `kernel_guest.py` there. Where the
packages cannot be had (no apt, no network) it is skipped with the reason, but not in CI.
"""

import shutil
import subprocess
import sys

import pytest

from board import kernel
from board.debian import CHECKOUT, skipping
from edge.demo import MODEL
from edge.skin import file as skinfile

SLOWED = {
    "rate_hz = 100.0": "rate_hz = 10.0",
    "release_s = 0.3 ": "release_s = 0.001 ",
    '"/dev/i2c-3"': "0",
}
"""An emulated machine reads some ten chips in a tenth of a second; and a contact that ends with the
first frame without it ends in the same frame at any rate."""


@pytest.fixture(scope="session")
def skins(tmp_path_factory):
    """The skins, each with a model: an MPR121 pad, and the last bus of Cody."""
    folder = kernel.FOLDER / "skins"
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    shutil.copy(CHECKOUT / "board" / "pad.toml", folder)
    head, *_, bus = skinfile.shipped("cody").read_text().split("[[bus]]")
    text = head + "[[bus]]" + bus
    for old, new in SLOWED.items():
        assert old in text
        text = text.replace(old, new)
    (folder / "cody.toml").write_text(text)
    touches = tmp_path_factory.mktemp("touches")
    fake = f"edge fake --skin {folder}/pad.toml --out {touches}"
    export = f"export --data {touches}/touches --out {touches} --features paper --projection pca"
    for command in (fake, f"{export} --decision-points none"):
        subprocess.run([sys.executable, "-m", *command.split()], cwd=CHECKOUT, check=True)
    shutil.copy(touches / "model.onnx", folder / "pad.onnx")
    shutil.copy(MODEL, folder / "cody.onnx")
    return folder


def test_the_skin_is_read_through_a_real_kernel(skins):
    command = (
        "PYTHONDONTWRITEBYTECODE=1 PYTEST_DISABLE_PLUGIN_AUTOLOAD=1 OPENBLAS_NUM_THREADS=1 "
        f"PYTHONPATH={CHECKOUT} SKINS={skins} {sys.executable} -m pytest "
        f"{CHECKOUT}/board/kernel_guest.py -vv --color=no --noconftest -p no:cacheprovider "
        f"--basetemp=/run/pytest --rootdir {CHECKOUT} --durations=10"
    )
    with skipping():
        status, printed = kernel.run_in_guest(command.split())
    print(printed)
    assert status == 0
