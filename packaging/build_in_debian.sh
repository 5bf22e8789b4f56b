#!/bin/bash
# Builds the Debian package with the Debian that it is for, in a tree of its own.
#
#   sudo packaging/build_in_debian.sh RELEASE [ARCHITECTURE]     into dist/
#
# RELEASE is bookworm or trixie, ARCHITECTURE amd64 (default) or arm64 (by emulation: qemu-user-static, binfmt_misc; half an
# hour). Needs debootstrap. BASE=DIR: a tree with python3-venv and ca-certificates. WORK=DIR: an own place, which is kept:
# interrupted, it goes on where it was. MIRROR: of Debian. pip's settings (PIP_*, /etc/pip.conf) and this machine's
# certificates are taken along. WHEELS=DIR: everything that pip would fetch (requirements.lock, hatchling, setuptools,
# shtab), from `pip download --platform manylinux_2_28_aarch64 --only-binary=:all:`: then pip asks no network by emulation.
set -euo pipefail

release=$1 architecture=${2:-amd64}
mirror=${MIRROR:-}   # empty: the one that debootstrap knows
source=$(realpath "$(dirname "$0")/..")
work=${WORK:-$(mktemp -d)}   # $TMPDIR says where: it takes 2 GB
root=$work/root
trap 'umount -l "$root/proc" 2>/dev/null || true; [ -n "${WORK:-}" ] || rm -rf "$work"' EXIT

mkdir -p "$work"
if [ -e "$work/tree" ]; then
    echo "going on in $root"
elif [ -n "${BASE:-}" ]; then
    rm -rf "$root"
    cp -a "$BASE" "$root"
else
    rm -rf "$root"
    debootstrap --arch="$architecture" --variant=minbase --include=python3,python3-venv,ca-certificates \
        "$release" "$root" ${mirror:+"$mirror"} >"$work/log" || { tail -5 "$work/log"; exit 1; }
fi
touch "$work/tree"
cp /etc/resolv.conf "$root/etc/resolv.conf"
cp -L /etc/ssl/certs/ca-certificates.crt "$root/etc/ssl/certs/ca-certificates.crt"
if [ -f /etc/pip.conf ]; then cp /etc/pip.conf "$root/etc/pip.conf"; fi
mount -t proc proc "$root/proc"
if ! compgen -G "$root/usr/include/python3*/Python.h" >/dev/null || [ ! -e "$root/usr/bin/g++" ]; then   # for the kernels
    chroot "$root" /bin/sh -c 'apt-get -qq update && apt-get -qq install --yes --no-install-recommends g++ python3-dev' >"$work/log" 2>&1 ||
        { tail -5 "$work/log"; exit 1; }
fi
rm -rf "$root/source"
mkdir "$root/source"
(cd "$source" && git ls-files -z | tar --create --null --files-from=-) | tar --extract --directory="$root/source"
settings=$(env | grep '^PIP_' || true)
if [ -n "${WHEELS:-}" ]; then
    mkdir -p "$root/wheels"
    cp "$WHEELS"/*.whl "$root/wheels/"
    settings="$settings PIP_FIND_LINKS=/wheels PIP_NO_INDEX=1"
fi
export SOURCE_DATE_EPOCH=$(git -C "$source" log -1 --format=%ct)
mkdir -p "$source/dist"
chroot "$root" /usr/bin/env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin HOME=/source LC_ALL=C.UTF-8 SOURCE_DATE_EPOCH=$SOURCE_DATE_EPOCH \
    $settings python3 /source/packaging/deb.py --tree --work /building
name=$(cat "$root/building/name")   # packed here: by emulation that alone takes a quarter of an hour
dpkg-deb --build --root-owner-group -Zxz "$root/building/stage" "$source/dist/$name" >/dev/null
ls -l "$source/dist/$name"
