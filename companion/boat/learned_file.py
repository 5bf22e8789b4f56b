"""The text of a boat file that was learned from logs: what a mission sails by, how well it is known, and from what."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence

from companion.boat.learn import TWA_DEG, TWS_MPS, Known
from companion.boat.lesson import Lesson

LEAST_TURN_DEG_S, MOST_TURN_DEG_S = 1.0, 120.0
MOST_ERROR_PERCENT = 60.0


def learned_text(
    name: str,
    lesson: Lesson,
    *,
    kept: Mapping[str, object],
    made: str,
    version: int,
    logs: Sequence[tuple[str, str]],
    skipped: Sequence[tuple[str, str]] = (),
) -> str:
    """Return the boat file of a lesson.

    Args:
        name: what the boat is called.
        lesson: what was learned.
        kept: keys of ``[boat]`` as they were; those that were learned take their place.
        made: how, in words.
        version: counts the files of this boat that were learned, from 1.
        logs: names and digests.
        skipped: names, and why.

    """
    boat, (keys, notes) = lesson.boat, _boat_keys(lesson, kept)
    left_out = ", ".join(f"{json.dumps(why.value)} = {n}" for why, n in lesson.left_out.most_common())
    lines = [
        f"name = {json.dumps(name)}",
        f"made = {json.dumps(made)}",
        "",
        "[boat]   # the keys of a mission's [boat]; what a mission says itself counts before this",
        *(_line(key, value, notes.get(key, "as it was")) for key, value in keys.items()),
        "",
        "[polar]   # through the water, by the bow's angle to the wind at the height of the vane",
        f"tws_mps = [{', '.join(f'{w:g}' for w in TWS_MPS)}]",
        f"twa_deg = [{', '.join(f'{a:g}' for a in TWA_DEG)}]",
        *_table("speed_mps", [[f"{v:.2f}" for v in row] for row in boat.polar.speed_mps_table]),
        *_table("error_percent", [[f"{100.0 * v:.0f}" for v in row] for row in boat.error]),
        *_table("stretches", [[str(v) for v in row] for row in boat.seen.tolist()]),
        "",
        "[learned]   # pairs are a figure and its deviation; angles are to starboard",
        f"version = {version}",
        f"stretches = {boat.stretches}   # of steady sailing, {lesson.hours:.1f} h",
        f"left_out = {{ {left_out} }}",
        f"no_go_deg = {_pair(lesson.no_go, True)}",
        f"vane_deg = {_pair(boat.vane, True)}",
        f"compass_deg = {_pair(boat.compass, True)}",
        f"leeway_deg = {_pair(boat.leeway, True)}",
        f"starboard_percent = [{100.0 * boat.lean.mean:.1f}, {100.0 * boat.lean.sd:.1f}]   # faster, close-hauled",
        *([] if lesson.vane_width is None else [f"vane_width_deg = {_pair(lesson.vane_width, True)}"]),
        *_table("currents_mps", [[f"{v:.2f}" for k in pair for v in (k.mean, k.sd)] for pair in boat.currents]),
        *([] if not boat.log_factors else [f"log_factors = [{', '.join(_pair(k, False) for k in boat.log_factors)}]"]),
        *_rows("angles", _angles(lesson)),
        *_rows("tacks", _tacks(lesson)),
        "findings = [",
        *(f"    {json.dumps(finding)}," for finding in lesson.findings),
        "]",
        *_rows("logs", [{"name": json.dumps(n), "digest": json.dumps(d)} for n, d in logs]),
        *_rows("skipped", [{"name": json.dumps(n), "why": json.dumps(w)} for n, w in skipped]),
    ]
    return "\n".join(lines) + "\n"


def _boat_keys(lesson: Lesson, kept: Mapping[str, object]) -> tuple[dict[str, object], dict[str, str]]:
    """Return the keys of ``[boat]``, those that were learned in place of those ``kept``, and what is noted at them."""
    keys = {k: v for k, v in kept.items() if k not in {"file", "polar"}}
    notes: dict[str, str] = {}

    def learned(key: str, value: float, note: str) -> None:
        keys[key], notes[key] = float(f"{value:.3g}"), note

    deg = math.degrees
    learned(
        "no_go_half_deg",
        round(deg(lesson.no_go.mean), 1),
        f"deviation {deg(lesson.no_go.sd):.1f}" + ("" if lesson.no_go_is_sailed else ", as it was believed"),
    )
    learned("no_go_error_deg", round(deg(lesson.no_go.sd), 1), "its share of the risk that a plan may take")
    if lesson.turn_rate is not None:
        rate = min(max(deg(lesson.turn_rate.mean), LEAST_TURN_DEG_S), MOST_TURN_DEG_S)
        learned("turn_rate_deg_s", round(rate, 1), f"deviation {deg(lesson.turn_rate.sd):.1f}")
    for key, told in (("tack_loss_s", lesson.tacks), ("gybe_loss_s", lesson.gybes)):
        if told.loss_s is not None:
            by = math.exp(told.loss_spread)
            learned(
                key,
                round(told.loss_s, 1),
                f"of {told.tried}; one costs {told.loss_s / by:.2g} to {told.loss_s * by:.2g}",
            )
    if lesson.tacks.tried:
        learned(
            "tack_fails",
            round(lesson.tacks.fails, 3),
            f"{lesson.tacks.failed} of {lesson.tacks.tried}; at most {lesson.tacks.fails_most:.2g}",
        )
    learned(
        "leeway_deg",
        round(deg(lesson.boat.leeway.mean), 1),
        f"deviation {deg(lesson.boat.leeway.sd):.1f}: beating, apparent wind 3 times her speed",
    )
    learned(
        "speed_error_percent",
        min(round(100.0 * lesson.boat.common, 1), MOST_ERROR_PERCENT),
        "all of [polar] may be off together by this",
    )
    return keys, notes


def _angles(lesson: Lesson) -> list[dict[str, str]]:
    return [
        {
            "tws_mps": f"{a.tws_mps:g}",
            "beat_deg": _triple(a.beat_deg),
            "beat_mps": f"{a.beat_mps:.2f}",
            "run_deg": _triple(a.run_deg),
            "run_mps": f"{a.run_mps:.2f}",
        }
        for a in lesson.angles
    ]


def _tacks(lesson: Lesson) -> list[dict[str, str]]:
    return [
        {
            "tws_mps": f"{w:g}",
            "tried": str(t.tried),
            "failed": str(t.failed),
            **({} if t.loss_s is None else {"loss_s": f"{t.loss_s:.1f}", "spread": f"{t.loss_spread:.2f}"}),
        }
        for w, t in lesson.tacks_by_wind
    ]


def _line(key: str, value: object, note: str) -> str:
    told = json.dumps(value) if isinstance(value, bool | str) else f"{value:g}"
    return f"{f'{key} = {told}':<28}# {note}"


def _pair(known: Known, is_angle: bool) -> str:
    a, b = (math.degrees(known.mean), math.degrees(known.sd)) if is_angle else (known.mean, known.sd)
    return f"[{a:.2f}, {b:.2f}]"


def _triple(values: tuple[float, float, float]) -> str:
    return f"[{', '.join(f'{v:.0f}' for v in values)}]"


def _table(key: str, rows: list[list[str]]) -> list[str]:
    return [f"{key} = [", *(f"    [{', '.join(row)}]," for row in rows), "]"]


def _rows(key: str, rows: list[dict[str, str]]) -> list[str]:
    inside = [f"    {{ {', '.join(f'{k} = {v}' for k, v in row.items())} }}," for row in rows]
    return [f"{key} = [", *inside, "]"] if inside else []
