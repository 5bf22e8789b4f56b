"""Encounters by the hundred: vessels that would hit our boat, and what both did about it by the rules of the road.

A seed gives the weather and the other vessel (``lab.campaigns.encounters``); some keep the rules, some keep their
course whatever. Each voyage is sailed on the embedded autopilot under the virtual clock and judged by its true tracks
(``sitl.scenario.colregs``): the distance to keep, and under the policy "rules" the rules too.

Our boat is on a reach or a broad reach, so that it holds its course by itself: on a beat nobody can tell standing on
from the next tack. The other is placed where both would nearly touch.
"""

from __future__ import annotations

import math
import random
import statistics
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Literal, get_args

from sitl.runner import SCENARIO_FOLDER, CampaignResults, Experiment, ExperimentSummary, Job, file_hash
from sitl.scenario import (
    CLOSE_HAULED_DEG,
    Craft,
    EventSpec,
    ExpectSpec,
    Manner,
    Mover,
    Scenario,
    WindSpec,
    duty,
    met_by,
)

Kind = Literal["crossing", "head-on", "overtaking", "sailing"]
Policy = Literal["rules", "keep clear"]
KINDS: tuple[Kind, ...] = get_args(Kind)
POLICIES: tuple[Policy, ...] = get_args(Policy)
Encounter = tuple[Kind, Policy]

AT_S = 75.0  # under way for half a minute, on course
OUR_MPS = 2.7
LEG_DEG = 90.0
RULE = {"crossing": "18", "head-on": "18", "overtaking": "13", "sailing": "12"}
SHOAL = 0.25  # of the voyages, and how many of the vessels keep the rules
KEEPS_RULES = 0.6
CLEAR_TACK_DEG = 12.0  # nearer to the wind's line nobody could tell the boat's tack
_MOTOR: tuple[tuple[Craft, float], ...] = (
    ("power", 0.5),
    ("fishing", 0.2),
    ("restricted", 0.1),
    ("not under command", 0.1),
    ("draught", 0.1),
)


def draw(seed: int, kind: Kind, policy: Policy) -> Scenario:
    """Return the scenario of a seed; kinds and policies of one seed have nothing to do with each other's weather."""
    rng = random.Random(f"encounter {kind} {seed}")
    twd_deg = (LEG_DEG + rng.choice((-1.0, 1.0)) * rng.uniform(75.0, 140.0)) % 360.0
    while True:
        event = _vessel(rng, kind)
        if _is(event, kind, twd_deg):
            break
    mission = "meeting-shoal" if rng.random() < SHOAL else "meeting"
    longer_s = 90.0 if kind == "overtaking" else 50.0
    return Scenario(
        name=f"{kind}-{seed}",
        mission=f"../missions/{mission}.toml",
        limit_s=AT_S + event.meet_s + longer_s,
        wind=WindSpec(
            model="ou",
            from_deg=round(twd_deg, 1),
            tws_mps=round(rng.uniform(3.5, 8.0), 2),
            sd_deg=round(rng.uniform(3.0, 7.0), 1),
            tws_sd_mps=round(rng.uniform(0.1, 0.5), 2),
        ),
        events=(event,),
        policy=policy,
        expect=ExpectSpec(arrived=None, max_silence_s=None),
    )


def _vessel(rng: random.Random, kind: Kind) -> EventSpec:
    craft: Craft = "sail" if kind == "sailing" else rng.choices(*zip(*_MOTOR, strict=True))[0]
    side = rng.choice((-1.0, 1.0))
    if kind == "crossing":
        course, sog, length = side * rng.uniform(45.0, 135.0), rng.uniform(2.5, 8.0), rng.uniform(15.0, 100.0)
    elif kind == "head-on":
        course, sog, length = side * rng.uniform(175.0, 180.0), rng.uniform(2.0, 7.0), rng.uniform(15.0, 100.0)
    elif kind == "sailing":
        course, sog, length = side * rng.uniform(25.0, 180.0), rng.uniform(1.5, 4.0), rng.uniform(7.0, 16.0)
    elif rng.random() < 0.5:
        course, sog, length = side * rng.uniform(0.0, 20.0), rng.uniform(5.0, 9.0), rng.uniform(15.0, 100.0)
    else:
        course, sog, length = side * rng.uniform(0.0, 20.0), rng.uniform(0.5, 1.2), rng.uniform(8.0, 40.0)
    manner: Manner = "rules" if rng.random() < KEEPS_RULES else "keeps"
    return EventSpec(
        at_s=AT_S,
        kind="meeting",
        course_deg=round(course, 1),
        sog_mps=round(sog, 2),
        length_m=round(length, 1),
        craft=craft,
        manner=manner,
        meet_s=round(rng.uniform(110.0, 160.0), 1),
        miss_m=round(rng.uniform(-25.0, 25.0), 1),
        react_s=round(rng.uniform(70.0, 130.0), 1),
        every_s=rng.choice((2.0, 6.0, 10.0, 10.0)),
        receiver=rng.choice(("autopilot", "feed")),
    )


def _is(event: EventSpec, kind: Kind, twd_deg: float) -> bool:
    """Whether an event is of the kind that was asked for, by the rules."""
    way = OUR_MPS * math.sin(math.radians(LEG_DEG)), OUR_MPS * math.cos(math.radians(LEG_DEG))
    place, course = met_by(((0.0, 0.0), way), event.course_deg, event.sog_mps, event.meet_s, event.miss_m)
    ours = Mover(
        en_m=(0.0, 0.0),
        course_rad=math.radians(LEG_DEG),
        heading_rad=math.radians(LEG_DEG),
        speed_mps=OUR_MPS,
        craft="sail",
    )
    hers = Mover(en_m=place, course_rad=course, heading_rad=course, speed_mps=event.sog_mps, craft=event.craft)
    off_wind = abs(math.remainder(math.degrees(course) - twd_deg, 360.0))
    if event.craft == "sail" and not CLOSE_HAULED_DEG <= off_wind <= 180.0 - CLEAR_TACK_DEG:
        return False
    return duty(ours, hers, math.radians(twd_deg))[0] == RULE[kind]


EXPANSIONS = 4_000
SOURCE = SCENARIO_FOLDER / "crossing.toml"  # the drawn ones are as if they lay beside it


def sail(job: Job[Encounter]) -> dict[str, Any]:
    """Sail one encounter and return how it went."""
    from companion.clock import run_virtual
    from sitl.run.embedded import run_embedded

    kind, policy = job.case
    scenario = draw(job.seed, kind, policy)
    figures: dict[str, Any] = {}
    with job.folder() as folder:
        try:
            verdict = run_virtual(run_embedded(scenario, job.scenario, job.seed, folder, expansions=EXPANSIONS))
            figures = verdict.figures
            faults = [f"{c.name}: {c.figure}" for c in verdict.checks if not c.passed]
        except Exception as error:
            faults = [repr(error)]
    met = (figures.get("encounters") or [None])[0]
    if met is None:
        faults.append("nobody was met")
    else:
        if not met["kept_distance"]:
            faults.append(f"{met['nearest_m']:.0f} m between the hulls")
        if policy == "rules":
            faults += met["faults"]
    event = scenario.events[0]
    return {
        "kind": kind,
        "policy": policy,
        "seed": job.seed,
        "passed": not faults,
        "faults": faults,
        "met": met,
        "shoal": "shoal" in scenario.mission,
        "wind": f"{scenario.wind.tws_mps:g} m/s from {scenario.wind.from_deg:g}",
        "vessel": f"{event.craft} of {event.length_m:g} m, {event.sog_mps:g} m/s, {event.course_deg:+g} deg off our "
        f"course, every {event.every_s:g} s by {event.receiver}, "
        + ("keeps the rules" if event.manner == "rules" else "keeps her course"),
        "replans": figures.get("replans"),
    }


def job_of(kind: Kind, policy: Policy, seed: int, keep: Path | None = None) -> Job[Encounter]:
    """Return an encounter as a job."""
    return Job(scenario=SOURCE, case=(kind, policy), seed=seed, keep=keep)


def encounters(
    *, runs: int, kinds: Sequence[Kind] = KINDS, policies: Sequence[Policy] = ("rules",), first_seed: int = 0
) -> Experiment[Encounter]:
    """Return ``runs`` seeds of each kind and policy; a table of them, and what failed."""

    def line(record: dict[str, Any]) -> str | None:
        return (
            None
            if record["passed"]
            else (
                f"FAILED {record['kind']}, {record['policy']}, seed {record['seed']}: {'; '.join(record['faults'])} "
                f"({record['vessel']}; wind {record['wind']}{'; shoal' if record['shoal'] else ''})"
            )
        )

    def sum_up(sailed: CampaignResults) -> ExperimentSummary:
        records = sorted(sailed.records, key=lambda r: (r["policy"], r["kind"], r["seed"]))
        rows = [
            row(kind, policy, found)
            for policy in policies
            for kind in kinds
            if (found := [r for r in records if (r["kind"], r["policy"]) == (kind, policy)])
        ]
        again = [
            f'again: sitl encounters --kind {r["kind"]} --policy "{r["policy"]}" --first-seed {r["seed"]} --keep DIR'
            for r in records
            if not r["passed"]
        ]
        return ExperimentSummary(
            lines=[*map(as_text, rows), sailed.took, *again],
            is_good=not again,
            figures={"table": rows, "voyages": records},
        )

    return Experiment(
        name="encounters",
        sail=sail,
        line=line,
        sum_up=sum_up,
        key=lambda job: {
            "scenario": "encounter",
            "hash": file_hash(job.scenario),
            "kind": job.case[0],
            "policy": job.case[1],
            "seed": job.seed,
        },
        jobs=[job_of(kind, policy, first_seed + n) for n in range(runs) for kind in kinds for policy in policies],
    )


def row(kind: str, policy: str, records: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """Return one row of the table."""
    met = [r["met"] for r in records if r["met"] is not None]
    ours = [m for m in met if m["duty"] == "we give way"]
    stood = [m for m in met if m["duty"] == "we stand on"]
    gaps = [m["nearest_m"] for m in met]
    left = [m["altered_left_s"] for m in ours if m["altered_left_s"] is not None]
    return {
        "kind": kind,
        "policy": policy,
        "voyages": len(records),
        "passed": sum(r["passed"] for r in records),
        "rules kept": sum(m["kept_rules"] for m in met),
        "distance kept": sum(m["kept_distance"] for m in met),
        "touched": sum(g <= 0.0 for g in gaps),
        "give way": len(ours),
        "kept giving way": sum(m["kept_rules"] for m in ours),
        "stand on": len(stood),
        "kept standing on": sum(m["kept_rules"] for m in stood),
        "stubborn": sum(m["manner"] == "keeps" and m["duty"] != "we give way" for m in met),
        "altered median deg": statistics.median(m["altered_deg"] for m in ours) if ours else None,
        "before median s": statistics.median(left) if left else None,
        "crossed": dict(Counter(m["crossed"] for m in ours if m["crossed"])),
        "nearest m": min(gaps, default=None),
        "nearest median m": statistics.median(gaps) if gaps else None,
        "failed seeds": [r["seed"] for r in records if not r["passed"]],
    }


def as_text(r: dict[str, Any]) -> str:
    """Return a row of the table as text."""
    return (
        f"{r['kind']}, {r['policy']}: {r['passed']} of {r['voyages']} passed; rules kept {r['rules kept']}, "
        f"distance kept {r['distance kept']}, touched {r['touched']}; nearest {_figure(r['nearest m'])} m, "
        f"median {_figure(r['nearest median m'])} m\n"
        f"  gave way {r['kept giving way']} of {r['give way']} by the rules (by "
        f"{_figure(r['altered median deg'])} deg, {_figure(r['before median s'])} s before, medians; crossed "
        f"{r['crossed'].get('astern', 0)} astern, {r['crossed'].get('ahead', 0)} ahead); stood on "
        f"{r['kept standing on']} of {r['stand on']} ({r['stubborn']} others did not act)"
    )


def _figure(value: float | None) -> str:
    return "-" if value is None else f"{value:.0f}"
