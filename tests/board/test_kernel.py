"""The commands and drivers under a real Linux kernel's /dev/i2c-N, over modelled chips.

`make kernel-test` runs this: it boots a Debian kernel under QEMU, without KVM, and runs
`kernel_guest.py` there. The kernel and QEMU are unpacked into `build/kernel`; nothing
is installed. The guest's root is this machine's own, read-only over 9p, with a writable
/run. Where the packages cannot be had (no apt, no network) the test is skipped with the
reason, but not in CI.
"""

import os
import platform
import re
import shlex
import shutil
import subprocess
import sys

import pytest

from edge.demo import MODEL
from edge.wire.skin import file as skinfile
from tests.board.debian import CHECKOUT, Unavailable, program, skipping, unpacked
from tests.conftest import ended

pytestmark = pytest.mark.slow
FOLDER = CHECKOUT / "build" / "kernel"
PACKAGES = ("qemu-system-x86", "linux-image-amd64", "busybox-static")
MODULES = """\
virtio_ring virtio virtio_pci_modern_dev virtio_pci_legacy_dev virtio_pci
9pnet netfs fscache 9pnet_virtio 9p
usb-common usbcore usbip-core vhci-hcd i2c-tiny-usb i2c-dev"""
"""Each after those that it needs."""

ENDED = "the command ended with status"
LONGEST_S = 900

QEMU = """\
-L {system}/usr/share/qemu -L {system}/usr/share/seabios
-accel tcg,thread=multi -cpu max -smp 2 -m 2048
-nodefaults -no-user-config -no-reboot -display none -serial stdio
-fsdev local,id=root,path=/,security_model=none,readonly=on,multidevs=remap
-device virtio-9p-pci,fsdev=root,mount_tag=host
-kernel {kernel} -initrd {initrd} -append"""
SLOWED = {
    "rate_hz = 100.0": "rate_hz = 10.0",
    "release_s = 0.3 ": "release_s = 0.001 ",
    '"/dev/i2c-3"': "0",
}
"""An emulated machine reads some ten chips in a tenth of a second; and a contact that
ends with the first frame without it ends in the same frame at any rate."""


def run_in_guest(command):
    """The exit status of a command that runs as root, and everything that the guest
    printed.

    The guest boots, runs the command and powers off.

    Raises:
        Unavailable: this machine cannot fetch or run the packages.
        RuntimeError: the guest did not reach its end.
    """
    if platform.machine() != "x86_64":
        raise Unavailable(
            "the kernel of the test runs programs of x86-64 machines alone"
        )
    system = unpacked(FOLDER / "system", "amd64", PACKAGES)
    kernel = next((system / "boot").glob("vmlinuz-*"))
    initrd = _initrd(system, command)
    qemu = ["timeout", str(LONGEST_S), *program(system, "qemu-system-x86_64")]
    qemu += QEMU.format(system=system, kernel=kernel, initrd=initrd).split()
    accelerators = next(system.rglob("accel-tcg-x86_64.so")).parent
    environment = {**os.environ, "QEMU_MODULE_DIR": str(accelerators)}
    options = {"stdin": subprocess.DEVNULL, "errors": "replace"}
    qemu.append("console=ttyS0 panic=-1 quiet")
    process = ended(*qemu, env=environment, **options)
    printed, end, rest = process.stdout.rpartition(ENDED)
    if not end:
        raise RuntimeError(
            f"the guest did not reach its end:\n{rest}\n{process.stderr}"
        )
    return int(rest.split()[0]), printed


def _initrd(system, command):
    """Make the archive that the kernel unpacks into memory and starts from."""
    root = FOLDER / "initrd.root"
    archive = FOLDER / "initrd"
    names = MODULES.split()
    shutil.rmtree(root, ignore_errors=True)
    for name in ("bin", "dev", "host", "modules", "proc", "sys"):
        (root / name).mkdir(parents=True)
    busybox = shutil.copy(system / "bin" / "busybox", root / "bin")
    for name in names:
        module = next((system / "lib" / "modules").rglob(f"{name}.ko"))
        shutil.copy(module, root / "modules")
    text = (CHECKOUT / "tests" / "board" / "kernel_init.sh").read_text()
    words = {"MODULES": " ".join(names), "COMMAND": shlex.join(command), "ENDED": ENDED}
    init = root / "init"
    init.write_text(re.sub("|".join(words), lambda word: words[word[0]], text))
    init.chmod(0o755)
    files = "\n".join(str(path.relative_to(root)) for path in sorted(root.rglob("*")))
    with archive.open("wb") as file:
        pack = [busybox, "cpio", "-o", "-H", "newc"]
        subprocess.run(pack, cwd=root, input=files.encode(), stdout=file, check=True)
    return archive


@pytest.fixture(scope="session")
def skins(tmp_path_factory):
    """The skins, each with a model: an MPR121 pad, and the last bus of Cody."""
    folder = FOLDER / "skins"
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    shutil.copy(CHECKOUT / "tests" / "board" / "pad.toml", folder)
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
        words = [sys.executable, "-m", *command.split()]
        subprocess.run(words, cwd=CHECKOUT, check=True)
    shutil.copy(touches / "model.onnx", folder / "pad.onnx")
    shutil.copy(MODEL, folder / "cody.onnx")
    return folder


def test_the_skin_is_read_through_a_real_kernel(skins):
    command = (
        "PYTHONDONTWRITEBYTECODE=1 PYTEST_DISABLE_PLUGIN_AUTOLOAD=1 "
        f"OPENBLAS_NUM_THREADS=1 PYTHONPATH={CHECKOUT} SKINS={skins} {sys.executable} "
        f"-m pytest {CHECKOUT}/tests/board/kernel_guest.py -vv --color=no --noconftest "
        f"-p no:cacheprovider --basetemp=/run/pytest --rootdir {CHECKOUT} "
        "--durations=10"
    )
    with skipping():
        status, printed = run_in_guest(command.split())
    print(printed)
    assert status == 0
