#!/bin/bash
# Inside a booted, clean Debian (see try_in_a_clean_debian.sh): the service beside a simulated autopilot.
set -u
wrong() { echo "WRONG: $*"; journalctl -u 'companion@*' --no-pager 2>/dev/null | tail -20; systemctl status --no-pager companion@lake | tail -30; exit 1; }
wait_for() { for _ in $(seq "$1"); do eval "$2" && return 0; sleep 1; done; return 1; }
status() { systemctl show -p StatusText --value companion@lake; }

trial=$(mktemp -d) && cd "$trial" || exit 1
companion mission example missions >/dev/null
systemd-run --quiet --unit=boat /usr/bin/sitl boat --port 0 --udp 0 --udp-out 127.0.0.1:14551 --warm --moored --home 50.817,-1.31
cp missions/lake.* /etc/companion/
echo 'LINK=udpin:127.0.0.1:14551' >/etc/companion/lake.env

began=$(date +%s%N)
systemctl start companion@lake || wrong "it does not start"
echo "ready after $((($(date +%s%N) - began) / 1000000)) ms: $(systemctl is-active companion@lake), $(status)"
began=$(date +%s)
wait_for 90 'grep -qs "\"kind\":\"plan\"" /var/log/companion/lake/voyages/*/decisions.jsonl' || wrong "no plan"
echo "first plan after $(($(date +%s) - began)) s"
[ -z "$(find /var/cache/companion -type f 2>/dev/null)" ] || wrong "kernels were compiled"
total=0
family() { echo "$1"; local child; for child in $(cat /proc/"$1"/task/*/children); do family "$child"; done; }
pids=$(family "$(systemctl show -p MainPID --value companion@lake)")
for pid in $pids; do
    kb=$(awk '/^Pss:/ {print $2}' "/proc/$pid/smaps_rollup"); total=$((total + kb))
done
echo "memory: $((total / 1000)) MB (PSS) of $(echo "$pids" | wc -l) processes"
[ $((total / 1000)) -lt 160 ] || wrong "more than 160 MB"

echo "killed as a crash would"
first=$(systemctl show -p MainPID --value companion@lake)
kill -SEGV "$first"
wait_for 60 '[ "$(systemctl show -p MainPID --value companion@lake)" != "$first" ] && [ "$(systemctl is-active companion@lake)" = active ]' || wrong "not started again"
echo "hung: stopped until the watchdog sees it"
second=$(systemctl show -p MainPID --value companion@lake)
kill -STOP "$second"
wait_for 100 '[ "$(systemctl show -p MainPID --value companion@lake)" != "$second" ] && [ "$(systemctl is-active companion@lake)" = active ]' || wrong "the watchdog did nothing"
wait_for 60 'status | grep -q :' || wrong "no status"
echo "again: $(status)"
systemctl stop companion@lake || wrong "it does not stop"
[ "$(systemctl show -p Result --value companion@lake)" = success ] || wrong "it stopped with $(systemctl show -p Result --value companion@lake)"
systemctl start companion@nothing 2>/dev/null && wrong "an instance without a mission started"
systemctl stop boat
rm -rf "$trial" /etc/companion/lake.*
systemd-analyze verify companion@lake.service 2>&1 | grep -i companion@ && wrong "verify"
systemd-analyze security --no-pager companion@lake.service | tail -1
echo "ALL IS WELL"
