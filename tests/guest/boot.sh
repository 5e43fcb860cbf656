#!/usr/bin/env bash
# Runs a command under Debian's kernel in QEMU, with made cameras of the vivid driver, and a made USB
# host controller into which a command can plug devices of its own.
#   tests/guest/boot.sh COMMAND [ARGUMENTS...]
# The guest sees this machine's files, read-only, and the same working directory. Ends with the
# command's exit status; 124 = out of time, 125 = the guest died, 77 = cannot run here, with the
# reason. PLATELIGHT_GUEST_KERNEL names a folder with boot/ and lib/modules/ if the kernel's package
# is unpacked rather than installed.
set -euo pipefail
kernel_root=${PLATELIGHT_GUEST_KERNEL:-/}
limit_s=${PLATELIGHT_GUEST_LIMIT_S:-600}

skip() {
  echo "skipped: $1 (Debian packages: qemu-system-x86 busybox-static kmod cpio linux-image-amd64)" >&2
  exit 77
}
PATH=$PATH:/usr/sbin:/sbin
for tool in qemu-system-x86_64 busybox cpio modprobe depmod; do
  command -v "$tool" >/dev/null || skip "there is no $tool"
done
version=
for modules in "$kernel_root"/lib/modules/*; do
  [ -r "$kernel_root/boot/vmlinuz-${modules##*/}" ] && version=${modules##*/}
done
[ -n "$version" ] || skip "there is no kernel in $kernel_root/boot with its modules"

work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
mkdir -p "$work"/initrd/{bin,modules,proc,sys,dev,host} "$work/out"

# Modules in the order in which they load. An unpacked package has no index of them yet.
module_root=$kernel_root
if [ ! -e "$kernel_root/lib/modules/$version/modules.dep.bin" ]; then
  module_root=$work/index
  mkdir -p "$module_root/lib/modules/$version"
  cp -rs "$(realpath "$kernel_root/lib/modules/$version")/." "$module_root/lib/modules/$version/"
  depmod -b "$module_root" "$version"
fi
for module in virtio_pci 9pnet_virtio 9p vivid vhci-hcd uvcvideo; do
  modprobe -d "$module_root" -S "$version" --show-depends "$module" 2>/dev/null ||
    skip "the kernel has no module $module"
done | while read -r verb path _; do
  [ "$verb" = insmod ] || continue
  name=${path##*/}
  [ -e "$work/initrd/modules/$name" ] && continue
  cp -L "$path" "$work/initrd/modules/"
  echo "$name" >>"$work/initrd/modules/order"
done

cp "$(command -v busybox)" "$work/initrd/bin/busybox"
cat >"$work/initrd/init" <<'INIT'
#!/bin/busybox sh
export PATH=/bin
/bin/busybox --install -s /bin
mount -t proc proc /proc
mount -t sysfs sysfs /sys
mount -t devtmpfs dev /dev
while read -r module; do
  options=
  # Two webcams; the other kinds of node that vivid can be are not wanted.
  [ "$module" = vivid.ko ] && options="n_devs=2 node_types=0x1,0x1 num_inputs=1,1 input_types=0,0"
  insmod "/modules/$module" $options || echo "cannot load $module"
done </modules/order
mount -t 9p -o ro,trans=virtio,version=9p2000.L,cache=loose,msize=262144 host /host
mount -t tmpfs tmpfs /host/run
mkdir /host/run/out
mount -t 9p -o trans=virtio,version=9p2000.L,msize=262144 out /host/run/out
for folder in proc sys dev; do mount -o bind /$folder /host/$folder; done
mkdir -p /host/dev/shm
mount -t tmpfs tmpfs /host/dev/shm
chroot /host /bin/bash /run/out/command.sh >/host/run/out/log 2>&1
echo $? >/host/run/out/status
sync
poweroff -f
INIT
chmod +x "$work/initrd/init"
{
  echo 'export PATH=/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin HOME=/run TMPDIR=/run'
  printf 'cd %q\n' "$PWD"
  printf '%q ' "$@"
  echo
} >"$work/out/command.sh"
(cd "$work/initrd" && find . | cpio -o -H newc --quiet) >"$work/initrd.img"

# /dev/kvm may be there and yet hang a stock kernel, unless the CPU shows its extension.
acceleration=(-accel tcg,thread=multi -cpu max)
if [ -w /dev/kvm ] && grep -qwE 'vmx|svm' /proc/cpuinfo; then acceleration=(-accel kvm -cpu host); fi
ended=0
timeout -k 5 "$limit_s" qemu-system-x86_64 "${acceleration[@]}" -machine q35 -smp 2 -m 1024 \
  -nographic -no-reboot -nodefaults -serial "file:$work/console" \
  -kernel "$kernel_root/boot/vmlinuz-$version" -initrd "$work/initrd.img" \
  -append "console=ttyS0 quiet panic=-1 tsc=reliable no_timer_check" \
  -fsdev local,id=host,path=/,security_model=none,readonly=on,multidevs=remap \
  -device virtio-9p-pci,fsdev=host,mount_tag=host \
  -fsdev "local,id=out,path=$work/out,security_model=none" \
  -device virtio-9p-pci,fsdev=out,mount_tag=out || ended=$?
[ -e "$work/out/log" ] && cat "$work/out/log"
if [ -s "$work/out/status" ]; then exit "$(cat "$work/out/status")"; fi
echo "the guest gave no status (QEMU ended with $ended); its console:" >&2
tail -60 "$work/console" >&2 || true
[ "$ended" -eq 124 ] && exit 124
exit 125
