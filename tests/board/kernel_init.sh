#!/bin/busybox sh
# The first process of the emulated kernel. It loads modules, makes the host's files its root, runs
# a command there as root, prints its status, and powers off. test_kernel.py fills in modules and command.
b=/bin/busybox
$b mount -t proc proc /proc; $b mount -t sysfs sys /sys; $b mount -t devtmpfs dev /dev
for module in MODULES; do $b insmod /modules/$module.ko || echo "$module cannot be loaded"; done
$b mount -t 9p -o trans=virtio,version=9p2000.L,msize=1048576,cache=loose,ro host /host
for folder in proc sys dev; do $b mount --bind /$folder /host/$folder; done
$b mount -t tmpfs run /host/run
$b ip link set lo up
$b chroot /host /usr/bin/env -i TMPDIR=/run PATH=/usr/sbin:/usr/bin:/sbin:/bin COMMAND
echo "ENDED $?"
$b poweroff -f
