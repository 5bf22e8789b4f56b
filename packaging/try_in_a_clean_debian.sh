#!/bin/bash
# Installs, starts, upgrades, removes and purges the Debian package in a clean Debian, and says what was wrong.
#
#   sudo packaging/try_in_a_clean_debian.sh PACKAGE.deb RELEASE [ARCHITECTURE]
#
# RELEASE is bookworm or trixie, ARCHITECTURE amd64 (default) or arm64 (by emulation: qemu-user-static, binfmt_misc).
# Needs debootstrap; with systemd-nspawn, and on this machine's own architecture, the service runs under a real systemd,
# beside a simulated autopilot; else the companion is started by hand. CLEAN=DIR: a tree that was bootstrapped before. MIRROR: of Debian.
set -euo pipefail

package=$(realpath "$1") release=$2 architecture=${3:-amd64}
mirror=${MIRROR:-}   # empty: the one that debootstrap knows
work=$(mktemp -d)   # $TMPDIR says where: it takes 2 GB
root=$work/root
trap 'umount -l "$root/proc" 2>/dev/null || true; rm -rf "$work"' EXIT

say() { echo "== $*"; }
wrong() { echo "WRONG: $*" >&2; exit 1; }
inside() { chroot "$root" /usr/bin/env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin HOME=/trial LC_ALL=C.UTF-8 "$@"; }
files() { (cd "$root" && find etc opt usr var/lib/companion var/log/companion var/cache/companion lib/systemd lib/udev \
    -xdev \( -type f -o -type l \) 2>/dev/null || true) | grep -vE '__pycache__|^etc/(ld.so.cache|passwd-?|group-?|g?shadow-?|subuid|subgid)|^etc/mtab|^etc/apt|^etc/.updated' | sort; }

say "a clean $release, $architecture"
if [ -n "${CLEAN:-}" ]; then
    cp -a "$CLEAN" "$root"
else
    debootstrap --arch="$architecture" --variant=minbase --include=systemd,systemd-sysv,dbus,udev,ca-certificates,adduser,libstdc++6 \
        "$release" "$root" ${mirror:+"$mirror"} >"$work/debootstrap.log" || { tail -5 "$work/debootstrap.log"; exit 1; }
fi
cp /etc/resolv.conf "$root/etc/resolv.conf"
inside apt-get -qq update
python=$(dpkg-deb -f "$package" Depends | grep -oE 'python3\.[0-9]+')
inside apt-get -qq install --yes --no-install-recommends "$python" adduser libstdc++6 libgcc-s1 >/dev/null 2>&1
mount -t proc proc "$root/proc"
files >"$work/before"   # (paths of this list are the package's or Debian's; voyages of the trial are removed)

say "install"
mkdir "$root/trial"   # the home of who tries it, and nothing else
cp "$package" "$root/trial/companion.deb"
inside dpkg -i /trial/companion.deb >"$work/install.log" 2>&1 || { cat "$work/install.log"; wrong "it does not install"; }
inside companion --version
inside id companion | grep -q dialout || wrong "the user is not in the group dialout"
if [ "$(inside find /opt/companion -user root -perm -o+w ! -type l | wc -l)" != 0 ]; then wrong "others may write to /opt/companion"; fi

say "nothing is compiled, and a voyage sails from an empty folder"
inside sh -c 'mkdir ~/voyage && cd ~/voyage && companion mission example mine >/dev/null &&
    companion mission check mine/lake.toml >/dev/null && sitl run rocks --out v' >"$work/sail.log" 2>&1 ||
    { cat "$work/sail.log"; wrong "it does not sail"; }
grep -q PASSED "$work/sail.log" || wrong "it does not sail"
compiled=$(find "$root/trial/.cache/sailboat-companion" -type f 2>/dev/null || true)
[ -z "$compiled" ] || wrong "kernels were compiled: $(head -3 <<<"$compiled")"

say "a conffile that was changed is kept"
echo 'OPTIONS=--keep-gb 1' >"$root/etc/companion/service.env"
inside dpkg -i --force-confold /trial/companion.deb >"$work/upgrade.log" 2>&1 || { cat "$work/upgrade.log"; wrong "no upgrade"; }
grep -q 'keep-gb 1' "$root/etc/companion/service.env" || wrong "the conffile was not kept"

if [ "$architecture" = "$(dpkg --print-architecture)" ] && command -v systemd-nspawn >/dev/null; then
    say "the service under a real systemd"
    install -D -m 755 "$(dirname "$0")/try_service.sh" "$root/usr/local/bin/try_service"
    printf '[Unit]\nAfter=multi-user.target\n[Service]\nType=oneshot\nExecStart=/usr/local/bin/try_service\nExecStopPost=/bin/systemctl --no-block poweroff\nStandardOutput=file:/trial/service.log\nStandardError=file:/trial/service.log\n[Install]\nWantedBy=multi-user.target\n' \
        >"$root/etc/systemd/system/try.service"
    inside systemctl enable try.service 2>/dev/null
    umount -l "$root/proc"
    timeout 600 systemd-nspawn -q -D "$root" --boot --register=no --keep-unit >"$work/boot.log" 2>&1 || true
    mount -t proc proc "$root/proc"
    cat "$root/trial/service.log"
    tail -1 "$root/trial/service.log" | grep -q '^ALL IS WELL' || wrong "the service"
    inside systemctl disable try.service 2>/dev/null || true
    rm -f "$root/etc/systemd/system/try.service" "$root/usr/local/bin/try_service"
else
    say "the companion beside a simulated boat, by hand"
    inside sh -c 'cd ~/voyage || exit 1
        sitl boat --port 0 --udp 0 --udp-out 127.0.0.1:14559 --warm --home 50.817,-1.31 >boat.log 2>&1 &
        boat=$!
        companion run mine/lake.toml --link udpin:127.0.0.1:14559 --out w --wait 300 --limit 300 >run.log 2>&1 &
        companion=$! began=$(date +%s)
        until grep -qs "\"kind\":\"plan\"" w/decisions.jsonl; do
            kill -0 $companion 2>/dev/null && [ $(($(date +%s) - began)) -lt 600 ] || break
            sleep 1
        done
        echo "first plan after $(($(date +%s) - began)) s"
        kill -INT $companion; wait $companion; kill $boat
        grep -qs "\"kind\":\"plan\"" w/decisions.jsonl' || { tail "$root"/trial/voyage/*.log; wrong "it does not plan"; }
fi

say "remove, and what is the user's stays; purge, and nothing does"
inside dpkg -r sailboat-companion >"$work/remove.log" 2>&1 || { cat "$work/remove.log"; wrong "it cannot be removed"; }
[ -f "$root/etc/companion/service.env" ] || wrong "remove took the conffile"
[ ! -e "$root/opt/companion" ] || wrong "remove left /opt/companion"
inside dpkg -P sailboat-companion >"$work/purge.log" 2>&1 || { cat "$work/purge.log"; wrong "it cannot be purged"; }
inside getent passwd companion >/dev/null && wrong "purge left the user"
files >"$work/after"
diff "$work/before" "$work/after" || wrong "purge left something"
say "all is well on $release, $architecture"
