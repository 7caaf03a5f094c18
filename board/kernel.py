"""A Debian kernel under QEMU, without KVM, that runs a program of this machine.

The kernel and QEMU are unpacked into `build/kernel`; nothing is installed. The guest's root is this
machine's own, read-only over 9p, with a writable /run.
"""

from __future__ import annotations

import os
import platform
import re
import shlex
import shutil
import subprocess
from collections.abc import Sequence
from pathlib import Path

from board.debian import CHECKOUT, Unavailable, program, unpacked

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


def run_in_guest(command: Sequence[str]) -> tuple[int, str]:
    """The exit status of a command that runs as root, and everything that the guest printed.

    The guest boots, runs the command and powers off.

    Raises:
        Unavailable: this machine cannot fetch or run the packages.
        RuntimeError: the guest did not reach its end.
    """
    if platform.machine() != "x86_64":
        raise Unavailable("the kernel of the test runs programs of x86-64 machines alone")
    system = unpacked(FOLDER / "system", "amd64", PACKAGES)
    kernel, initrd = next((system / "boot").glob("vmlinuz-*")), _initrd(system, command)
    qemu = ["timeout", str(LONGEST_S), *program(system, "qemu-system-x86_64")]
    qemu += QEMU.format(system=system, kernel=kernel, initrd=initrd).split()
    accelerators = next(system.rglob("accel-tcg-x86_64.so")).parent
    done = subprocess.run(
        [*qemu, "console=ttyS0 panic=-1 quiet"],
        env={**os.environ, "QEMU_MODULE_DIR": str(accelerators)},
        check=False,
        stdin=subprocess.DEVNULL,
        capture_output=True,
    )
    printed, ended, rest = done.stdout.decode(errors="replace").rpartition(ENDED)
    if not ended:
        raise RuntimeError(f"the guest did not reach its end:\n{rest}\n{done.stderr.decode()}")
    return int(rest.split()[0]), printed


def _initrd(system: Path, command: Sequence[str]) -> Path:
    """Make the archive that the kernel unpacks into memory and starts from."""
    root, archive, names = FOLDER / "initrd.root", FOLDER / "initrd", MODULES.split()
    shutil.rmtree(root, ignore_errors=True)
    for name in ("bin", "dev", "host", "modules", "proc", "sys"):
        (root / name).mkdir(parents=True)
    busybox = shutil.copy(system / "bin" / "busybox", root / "bin")
    for name in names:
        shutil.copy(next((system / "lib" / "modules").rglob(f"{name}.ko")), root / "modules")
    text = (CHECKOUT / "board" / "kernel_init.sh").read_text()
    words = {"MODULES": " ".join(names), "COMMAND": shlex.join(command), "ENDED": ENDED}
    init = root / "init"
    init.write_text(re.sub("|".join(words), lambda word: words[word[0]], text))
    init.chmod(0o755)
    files = "\n".join(str(path.relative_to(root)) for path in sorted(root.rglob("*")))
    with archive.open("wb") as file:
        pack = [busybox, "cpio", "-o", "-H", "newc"]
        subprocess.run(pack, cwd=root, input=files.encode(), stdout=file, check=True)
    return archive
