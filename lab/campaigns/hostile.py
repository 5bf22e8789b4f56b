"""What each forged message does to a companion that sails: measured, one after another, on the simulated autopilot.

The boat sails a long reach in a steady wind on which nothing happens, under the virtual clock. Every few seconds
somebody on the same channel sends one kind of forgery for two seconds; what the companion then believes, says and
orders is noted, less what it does without a forger.
"""

from __future__ import annotations

import asyncio
import contextlib
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from companion.app.options import SailOptions, at_once
from companion.app.sail import sail
from companion.clock import now_s, run_virtual
from companion.errors import InputError
from companion.fold import Step
from companion.geo import DEGREE_M
from companion.geo.angles import difference_rad
from companion.geofence import load_mission
from companion.mavlink.signing import SigningStore
from companion.messages import GeoPoint
from companion.skipper.behaviors import TOLD_S
from companion.skipper.step import Phase
from companion.skipper.step import actions as act
from lab.campaigns.reads import READS
from lab.campaigns.signed_link import SignedEnd, Signer
from sitl.autopilot import EPOCH_S, AutopilotConfig, MemoryLink, RadioChannel, SimulatedAutopilot, serve
from sitl.faults import FORGERIES, FaultyPlanner, Forger, Forgery
from sitl.world import AR1

BEGIN, END = "<!-- made by `sitl hostile --document docs/reference/mavlink.md` -->", "<!-- end of the table -->"
BURST_S = 2.0
QUIET_S = 4.0  # after the last frame, for what comes of it
CLEAR_S = 15.0  # at most, until what was raised is over
SETTLED_S = 15.0  # under way before the first
LIMIT_S = 3000.0
TWD_RAD, TWS_MPS = 0.0, 6.0

_MISSION = """name = "hostile"
[start]
lat = 50.8
lon = -1.3
heading_deg = 90.0
[[goal]]
lat = 50.8
lon = -1.15
radius_m = 20.0
[area]
margin_m = 12.0
[operator]
arm = true
set_auto = true
[skipper]
expansions = 2000
"""

# What is false in a step when a figure of it is this far from the truth.
FALSE_PLACE_M, FALSE_ANGLE_RAD = 20.0, math.radians(20.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class Hostility:
    """Who forges: ``name`` heads the column. What is seen in each of ``runs`` counts: the rest is luck."""

    name: str
    listens: bool
    is_signed: bool = False
    rate_hz: float = 20.0
    runs: int = 1


BLIND = Hostility(name="who does not listen", listens=False, rate_hz=5.0, runs=2)
LISTENING = Hostility(name="who listens", listens=True)
AGAINST_A_KEY = Hostility(name="against a key", listens=True, is_signed=True)
HOSTILITIES = (BLIND, LISTENING, AGAINST_A_KEY)


@dataclass(slots=True)
class _Trial:
    """The run of one forger."""

    autopilot: SimulatedAutopilot
    air: RadioChannel
    forger: Forger
    rate_hz: float
    seen: set[str] = field(default_factory=set)
    last: Step | None = None
    looked: asyncio.Event = field(default_factory=asyncio.Event)

    async def until(self, holds: Callable[[Step], bool], limit_s: float = LIMIT_S) -> None:
        """Wait for a step of which something holds, at most ``limit_s``."""
        with contextlib.suppress(TimeoutError):
            async with asyncio.timeout(limit_s):
                while self.last is None or not holds(self.last):
                    self.looked.clear()
                    await self.looked.wait()

    def look(self, step: Step) -> None:
        """Note what a step believes, says and orders."""
        self.last = step
        self.looked.set()
        self.seen |= {word for action in step.actions if (word := _ordered(action))}
        self.seen |= set(_false(step, self.autopilot))
        if step.state.vehicle.doubt:
            self.seen.add("orders stop")
        if step.state.phase is Phase.OPERATOR and not step.state.vehicle.doubt:
            self.seen.add("stands by as for an operator")


def _ordered(action: act.Action) -> str:
    if isinstance(action, act.Announce):
        return "" if action.code.endswith(" over") or action.code == "ours" else f'says "{action.code}"'
    if isinstance(action, act.SetMode):
        return f"orders {action.mode.name}"
    return {
        act.RequestPlan: "plans anew",
        act.UploadMission: "uploads",
        act.Arm: "orders arming",
        act.SetCurrent: "sets the item",
        act.SetParameter: "writes a parameter",
        act.SteerHeading: "steers",
        act.ReadMission: "reads the mission",
    }.get(type(action), "")


def _false(step: Step, autopilot: SimulatedAutopilot) -> list[str]:
    """Return what a step takes for true that is not."""
    truth, snapshot = autopilot.truth, step.snapshot
    status, vehicle, out = snapshot.autopilot, snapshot.vehicle, []
    if vehicle is not None:
        out += ["false position"] * (_apart_m(vehicle.position, truth.position) > FALSE_PLACE_M)
        out += ["false heading"] * (abs(difference_rad(vehicle.heading_rad, truth.heading_rad)) > FALSE_ANGLE_RAD)
    if snapshot.wind.present_twd_from_rad is not None:
        out += ["false wind"] * (abs(difference_rad(snapshot.wind.present_twd_from_rad, TWD_RAD)) > FALSE_ANGLE_RAD)
    if status is not None:
        out += ["false mode"] * (status.mode is not truth.mode)
        out += ["false arming"] * (status.is_armed is not truth.is_armed)
        out += ["false item"] * (status.mission_seq != truth.mission_seq)
        out += ["false cross track"] * (abs(status.cross_track_m or 0.0) > 100.0)
        out += ["false EKF state"] * (not status.ekf_ok)
        out += ["false GPS state"] * (status.gps_fix is not None and status.gps_fix < 3)
        out += ["false battery"] * (status.battery_remaining is not None and status.battery_remaining < 0.5)
        out += ["false leak"] * bool(status.sensor("LEAK"))
        out += ["false time"] * (status.utc_at_boot_s is not None and status.utc_at_boot_s < EPOCH_S - 3600.0)
        out += ["false fence state"] * bool(status.fence_breached)
        out += ["a person at the sticks"] * (snapshot.t_s - step.state.operator.signs.rc_moved_s <= TOLD_S)
        core = autopilot.core
        if status.home is not None and core.home_en is not None:
            out += ["false home"] * (_apart_m(status.home, core.chart.point(core.home_en)) > FALSE_PLACE_M)
    if snapshot.limits is not None:
        out += ["false limit"] * (math.degrees(snapshot.limits.sail_no_go_angle_rad) > 50.0)
    out += ["a ghost ship"] * (snapshot.traffic is not None and bool(snapshot.traffic.vessels))
    return out


def _apart_m(a: GeoPoint, b: GeoPoint) -> float:
    """Return about how far two places are apart [m]: a degree of longitude is taken for one of latitude."""
    return math.dist((a.lat_deg, a.lon_deg), (b.lat_deg, b.lon_deg)) * DEGREE_M


async def _measure(
    who: Hostility, folder: Path, bursts: Sequence[Sequence[Forgery]], seed: int = 0
) -> list[tuple[str, ...]]:
    """Sail, send one burst of forgeries after another, and return what each did."""
    folder.mkdir(parents=True, exist_ok=True)
    mission_path = folder / "hostile.toml"
    mission_path.write_text(_MISSION, encoding="utf-8")
    mission = load_mission(mission_path)
    assert mission.start is not None
    autopilot = SimulatedAutopilot(
        AutopilotConfig(home=mission.start, heading_rad=math.pi / 2.0, is_warm=True, is_moored=True),
        AR1(TWD_RAD, TWS_MPS, seed=1, sd_rad=math.radians(3.0)),
        seed=1,
    )
    line = MemoryLink("hostile", seed=1)
    signing = _store(folder) if who.is_signed else None
    end = line.near if signing is None else SignedEnd(line.near, Signer(signing.state.key, signing.state.timestamp))
    forger = Forger(listens=who.listens, seed=seed)
    air = RadioChannel(end, on_heard=lambda data: forger.hear(now_s(), data))
    trial = _Trial(autopilot=autopilot, air=air, forger=forger, rate_hz=who.rate_hz)
    options = SailOptions(
        epoch_s=EPOCH_S,
        expansions=mission.skipper.expansions,
        offload=at_once,
        is_durable=False,
        signing=signing,
        limit_s=LIMIT_S,
        command="sitl hostile",
    )
    async with serve(autopilot, [line.far]):
        voyage = asyncio.create_task(
            sail(mission, air, FaultyPlanner(), folder / "voyage", options, on_status=lambda _, s: trial.look(s))
        )
        try:
            return await _forge_all(trial, bursts)
        finally:
            voyage.cancel()
            await asyncio.wait([voyage])
            if not voyage.cancelled():
                voyage.result()


async def _forge_all(trial: _Trial, bursts: Sequence[Sequence[Forgery]]) -> list[tuple[str, ...]]:
    await trial.until(lambda step: step.state.voyage.sailing)
    await asyncio.sleep(SETTLED_S)
    without = {in_a_read: await _window(trial, (), in_a_read=in_a_read) for in_a_read in (False, True)}
    out = []
    for burst in bursts:
        in_a_read = any(forgery.in_a_read for forgery in burst)
        seen = await _window(trial, burst, in_a_read=in_a_read)
        out.append(tuple(sorted(seen - without[in_a_read])))
    return out


async def _window(trial: _Trial, burst: Sequence[Forgery], *, in_a_read: bool) -> set[str]:
    """Forge for two seconds and return what came of it, once all is quiet again."""
    assert trial.last is not None
    before = set(_false(trial.last, trial.autopilot))
    trial.seen = set()
    if in_a_read:
        trial.autopilot.core.voice.announce(6, "Flight plan received")
        await trial.until(lambda step: step.state.pending.read is not None)
    for _ in range(round(BURST_S * trial.rate_hz)):
        for forgery in burst:
            trial.air.say(trial.forger.frame(now_s(), forgery))
        await asyncio.sleep(1.0 / trial.rate_hz)
    await asyncio.sleep(QUIET_S)
    seen = trial.seen - before
    await trial.until(lambda step: _is_quiet(step, trial.autopilot), CLEAR_S)
    return seen


def _is_quiet(step: Step, autopilot: SimulatedAutopilot) -> bool:
    state = step.state
    return not (
        _false(step, autopilot)
        or state.vehicle.doubt
        or state.alarms.raised
        or state.mission.foreign
        or state.pending.plan
        or state.pending.upload
        or state.pending.read
    )


def _store(folder: Path) -> SigningStore:
    key = folder / "key"
    key.write_text("0123456789abcdef" * 4, encoding="ascii")
    key.chmod(0o600)
    return SigningStore(key, EPOCH_S)


def measure(who: Hostility, folder: Path, forgeries: Sequence[Forgery] = FORGERIES) -> dict[Forgery, tuple[str, ...]]:
    """Return what each forgery does to a companion in the hands of ``who``; files go to ``folder``."""
    bursts = [(forgery,) for forgery in forgeries]
    runs = [run_virtual(_measure(who, folder / str(n), bursts, n)) for n in range(who.runs)]
    seen = [tuple(sorted(set.intersection(*map(set, each)))) for each in zip(*runs, strict=True)]
    return dict(zip(forgeries, seen, strict=True))


def measure_together(who: Hostility, folder: Path, forgeries: Sequence[Forgery] = FORGERIES) -> tuple[str, ...]:
    """Return what all forgeries do at once: where that is nothing, none of them does anything."""
    return run_virtual(_measure(who, folder, [forgeries]))[0]


def rows(effects: Mapping[str, Mapping[Forgery, tuple[str, ...]]]) -> list[str]:
    """Return the lines of the table message x effect; ``effects`` by the name of who forges."""
    head = ["message", "read by", "forged", *effects]
    lines = ["| " + " | ".join(head) + " |", "|" + "---|" * len(head)]
    for forgery in FORGERIES:
        cells = [f"`{forgery.message}`", ", ".join(READS[forgery.message]), forgery.says]
        cells += [", ".join(column[forgery]) or "-" for column in effects.values()]
        lines.append("| " + " | ".join(cells) + " |")
    return lines


def written(text: str, lines: Sequence[str]) -> str:
    """Return a document's ``text`` with the table between its marks replaced.

    Raises:
        InputError: it has no such marks.
    """
    before, begin, rest = text.partition(BEGIN)
    _, end, after = rest.partition(END)
    if not begin or not end:
        raise InputError("--document", BEGIN, "is not in the file", f"write it and {END} where the table belongs")
    return before + BEGIN + "\n" + "\n".join(lines) + "\n" + END + after
