"""A Debian kernel under QEMU, without KVM, that runs a program of this machine.

The kernel and QEMU are unpacked into `build/kernel`; nothing is installed. The guest's root is this
machine's own, read-only over 9p, with a writable /run.
"""

from __future__ import annotations

import platform
import shlex
import shutil
import subprocess
from collections.abc import Sequence
from pathlib import Path

from debian import Unavailable, once, unpack

CHECKOUT = Path(__file__).resolve().parents[1]
FOLDER = CHECKOUT / "build" / "kernel"
PACKAGES = ("qemu-system-x86", "linux-image-amd64", "busybox-static")
MODULES = """\
virtio_ring virtio virtio_pci_modern_dev virtio_pci_legacy_dev virtio_pci
9pnet netfs fscache 9pnet_virtio 9p
usb-common usbcore usbip-core vhci-hcd i2c-tiny-usb i2c-dev"""
"""Each after those that it needs."""

INIT = """\
#!/bin/busybox sh
b=/bin/busybox
$b mount -t proc proc /proc; $b mount -t sysfs sys /sys; $b mount -t devtmpfs dev /dev
for module in {modules}; do $b insmod /modules/$module.ko || echo "$module cannot be loaded"; done
$b mount -t 9p -o trans=virtio,version=9p2000.L,msize=1048576,cache=loose,ro host /host
for folder in proc sys dev; do $b mount --bind /$folder /host/$folder; done
$b mount -t tmpfs run /host/run
$b ip link set lo up
$b chroot /host /usr/bin/env -i TMPDIR=/run PATH=/usr/sbin:/usr/bin:/sbin:/bin {command}
echo "{ended} $?"
$b poweroff -f
"""
"""The guest's first process."""
ENDED = "the command ended with status"
LONGEST_S = 900

QEMU = """\
timeout {longest} env QEMU_MODULE_DIR={accelerators} {system}/lib64/ld-linux-x86-64.so.2
--library-path {libraries} {system}/usr/bin/qemu-system-x86_64
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
    FOLDER.mkdir(parents=True, exist_ok=True)
    system = FOLDER / "system"
    once(system, "\n".join(PACKAGES), lambda at: unpack(at, "amd64", PACKAGES))
    qemu = QEMU.format(
        longest=LONGEST_S,
        system=system,
        libraries=":".join({str(p.parent) for p in system.rglob("*-linux-gnu*/lib*.so.*")}),
        accelerators=next(system.rglob("accel-tcg-x86_64.so")).parent,
        kernel=next((system / "boot").glob("vmlinuz-*")),
        initrd=_initrd(system, command),
    )
    command_line = [*qemu.split(), "console=ttyS0 panic=-1 quiet"]
    console = FOLDER / "console.txt"
    with console.open("w") as file:
        to_file = {"stdin": subprocess.DEVNULL, "stdout": file, "stderr": subprocess.STDOUT}
        subprocess.run(command_line, check=False, **to_file)
    printed, ended, rest = console.read_text(errors="replace").rpartition(ENDED)
    if not ended:
        raise RuntimeError(f"the guest did not reach its end:\n{rest}")
    return int(rest.split()[0]), printed


def _initrd(system: Path, command: Sequence[str]) -> Path:
    """Make the archive that the kernel unpacks into memory and starts from."""
    root, archive, names = FOLDER / "initrd.root", FOLDER / "initrd", MODULES.split()
    shutil.rmtree(root, ignore_errors=True)
    for name in ("bin", "dev", "host", "modules", "proc", "sys"):
        (root / name).mkdir(parents=True)
    busybox = shutil.copy(system / "bin" / "busybox", root / "bin")
    for name in names:
        (module,) = (system / "lib" / "modules").rglob(f"{name}.ko")
        shutil.copy(module, root / "modules")
    init = root / "init"
    init.write_text(INIT.format(modules=" ".join(names), command=shlex.join(command), ended=ENDED))
    init.chmod(0o755)
    files = "\n".join(str(path.relative_to(root)) for path in sorted(root.rglob("*")))
    pack = [busybox, "cpio", "-o", "-H", "newc"]
    done = subprocess.run(pack, cwd=root, input=files.encode(), capture_output=True, check=True)
    archive.write_bytes(done.stdout)
    return archive
