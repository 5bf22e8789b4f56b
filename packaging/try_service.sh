#!/bin/bash
# Inside a booted, clean Debian (see try_in_a_clean_debian.sh): the service beside a simulated autopilot.
set -u
wrong() { echo "WRONG: $*"; journalctl -u 'companion@*' --no-pager 2>/dev/null | tail -20; systemctl status --no-pager companion@lake | tail -30; exit 1; }
wait_for() { for _ in $(seq "$1"); do eval "$2" && return 0; sleep 1; done; return 1; }
status() { systemctl show -p StatusText --value companion@lake; }

trial=$(mktemp -d) && cd "$trial" || exit 1
companion mission example missions >/dev/null
systemd-run --quiet --collect --unit=boat /usr/bin/sitl boat --port 0 --udp 0 --udp-out 127.0.0.1:14551 --warm --moored --home 50.817,-1.31
cp missions/lake.* /etc/companion/
echo 'LINK=udpin:127.0.0.1:14551' >/etc/companion/lake.env

cat >problem.json <<'END'
{"id": "first", "title": "first", "start": {"x": 0, "y": 0, "heading_deg": 10}, "goal": {"x": 5, "y": 900, "radius": 10},
 "obstacles": ["POLYGON ((-90 300, 90 300, 90 400, -90 400, -90 300))"], "fence": null, "delta_s": 0.9,
 "wind": {"from_deg": 5, "speed_mps": 5, "sigma": {"model": "kalman", "sigma0_deg": 2, "growth_deg_per_sqrt_s": 0.2}},
 "boat": {"no_go_half_deg": 42, "max_twa_deg": 165, "turn_rate_rad_s": 0.5,
          "speed": {"model": "polar", "twa_deg": [0, 45, 90, 180], "v_mps": [0, 1, 1.6, 1.2]}}}
END
began=$(date +%s%N)
companion plan problem.json >plan.txt || wrong "no plan: $(cat plan.txt)"
took=$((($(date +%s%N) - began) / 1000000))
echo "a first plan, from the start of its process: $took ms"
[ $took -lt "${LIMIT_MS:-5000}" ] || wrong "more than ${LIMIT_MS:-5000} ms"

began=$(date +%s%N)
systemctl start companion@lake || wrong "it does not start"
took=$((($(date +%s%N) - began) / 1000000))
echo "ready after $took ms: $(systemctl is-active companion@lake), $(status)"
[ $took -lt "${LIMIT_MS:-5000}" ] || wrong "more than ${LIMIT_MS:-5000} ms"
began=$(date +%s)
wait_for 90 'grep -qs "\"kind\":\"plan\"" /var/log/companion/lake/voyages/*/decisions.jsonl' || wrong "no plan"
echo "first plan after $(($(date +%s) - began)) s, half a minute of it to learn the wind"
[ -z "$(find /var/cache/companion -type f 2>/dev/null)" ] || wrong "kernels were compiled"
family() { echo "$1"; local child; for child in $(cat /proc/"$1"/task/*/children); do family "$child"; done; }
pids=$(family "$(systemctl show -p MainPID --value companion@lake)")
memory() { local total=0 kb; for pid in $pids; do
    kb=$(awk '/^Pss:/ {print $2}' "/proc/$pid/smaps_rollup"); total=$((total + kb)); done; echo $((total / 1000)); }
for pid in $pids; do grep -q llvm "/proc/$pid/maps" && wrong "LLVM was loaded"; done
most=0
for _ in $(seq 60); do now=$(memory); [ "$now" -gt $most ] && most=$now; sleep 0.5; done
plans=$(cat /var/log/companion/lake/voyages/*/decisions.jsonl | grep -c '"kind":"plan"')
systemctl stop boat   # with which it shares libraries
alone=$(memory)
systemd-run --quiet --collect --unit=boat /usr/bin/sitl boat --port 0 --udp 0 --udp-out 127.0.0.1:14551 --warm --home 50.817,-1.31
echo "memory (PSS) of $(echo "$pids" | wc -l) processes: $most MB at most in 30 s and $plans plans, $alone MB alone"
[ "$alone" -lt 160 ] && [ $most -lt 160 ] || wrong "more than 160 MB"

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
systemd-analyze verify /lib/systemd/system/companion@.service 2>&1 | grep -i companion@ && wrong "verify"
systemd-analyze security --no-pager companion@lake.service | tail -1
echo "ALL IS WELL"
