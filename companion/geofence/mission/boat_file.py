"""The boat file: what one boat can do, in a TOML of its own that the missions of that boat name.

``[boat]`` has the keys of a mission's ``[boat]``, ``[polar]`` the boat's speeds. What a mission says itself counts
before what its boat's file says.
"""

from __future__ import annotations

import re
import tomllib
from pathlib import Path
from typing import Any

import msgspec
from msgspec import Struct

from companion.errors import InputError, not_toml
from companion.geofence.formats.untrusted import decode, read_bytes
from companion.geofence.mission.options import BoatOptions
from companion.words import expected

MAX_BYTES = 1_000_000
POLARS = frozenset({".pol", ".csv"})  # the endings of polars, which a boat file names
OWN = ("file", "polar")  # keys of a mission's [boat] that are none of the boat's


class PolarTable(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """``[polar]``: boat speed through the water [m/s], a row for each true wind angle."""

    tws_mps: tuple[float, ...]
    twa_deg: tuple[float, ...]
    speed_mps: tuple[tuple[float, ...], ...]
    error_percent: tuple[tuple[float, ...], ...] = ()
    """How far each speed may be off [%, standard deviation of the logarithm]; empty: nobody says."""
    stretches: tuple[tuple[int, ...], ...] = ()
    """Of how many stretches of steady sailing each speed is."""


Pair = tuple[float, float]
"""A figure and its standard deviation."""


class Angles(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Best angles in one wind: low, middle and high [deg], and what they make good [m/s]."""

    tws_mps: float
    beat_deg: tuple[float, float, float]
    beat_mps: float
    run_deg: tuple[float, float, float]
    run_mps: float


class Tacks(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Tacks in one wind: what one costs [s] and by how much that differs (deviation of its logarithm)."""

    tws_mps: float
    tried: int
    failed: int
    loss_s: float | None = None
    spread: float | None = None


class LearnedLog(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """A log that was learned from."""

    name: str
    digest: str


class SkippedLog(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """A log that was not."""

    name: str
    why: str


class LearnedTable(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """``[learned]``: of a boat that was learned from its logs, from what and how well."""

    version: int
    stretches: int
    left_out: dict[str, int] = {}
    no_go_deg: Pair
    vane_deg: Pair
    compass_deg: Pair
    leeway_deg: Pair
    starboard_percent: Pair = (0.0, 0.0)
    vane_width_deg: Pair | None = None
    currents_mps: tuple[tuple[float, float, float, float], ...] = ()
    """For each outing: east, its deviation, north, its deviation."""
    log_factors: tuple[Pair, ...] = ()
    angles: tuple[Angles, ...] = ()
    tacks: tuple[Tacks, ...] = ()
    findings: tuple[str, ...] = ()
    logs: tuple[LearnedLog, ...] = ()
    skipped: tuple[SkippedLog, ...] = ()


class BoatFile(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """A boat file as it is read."""

    name: str
    polar: PolarTable
    made: str = ""
    """How, of what and when, in words."""
    boat: BoatOptions = msgspec.field(default_factory=BoatOptions)
    learned: LearnedTable | None = None


def read_boat_file(path: Path) -> BoatFile:
    """Read a boat file. Raises InputError naming the key, what is wrong and the remedy."""
    return parse_boat_file(decode(read_bytes(path, max_bytes=MAX_BYTES), str(path)), str(path))


def parse_boat_file(text: str, source: str) -> BoatFile:
    """Return the boat that ``text`` tells of; see ``read_boat_file``."""
    if not text.strip():
        raise InputError(source, "", "is empty", "companion boat guess writes one")
    raw = _raw(text, source)
    if "goal" in raw:
        raise InputError(source, "", "is a mission, not a boat file", f"check it by: companion mission check {source}")
    table = raw.get("boat")
    for key in OWN:
        if isinstance(table, dict) and key in table:
            raise InputError(source, f"[boat] {key}", "has no place in a boat file", "the speeds are in [polar]")
    try:
        return msgspec.convert(raw, BoatFile)
    except msgspec.ValidationError as error:
        what, _, path = str(error).partition(" - at `$")
        head, _, key = path.strip("`.").partition(".")
        where = f"[{head}] {key}" if key or head in BoatFile.__struct_fields__ else head
        odd = re.search(r"(unknown|missing required) field `(.+)`", what)
        if odd:
            where, what = f"{where.rstrip()} {odd[2]}", "unknown key" if odd[1] == "unknown" else "is missing"
        raise InputError(
            source, where.strip(), what if odd else expected(what), "companion boat guess writes an example"
        ) from None


def with_boat_file(options: BoatOptions, mission_text: str, path: Path) -> BoatOptions:
    """Return a mission's ``[boat]`` with what its boat file says wherever the mission itself is silent.

    Raises InputError: the file cannot be read.
    """
    if options.file is None:
        return options
    named = path.parent / options.file
    try:
        text = decode(read_bytes(named, max_bytes=MAX_BYTES), str(named))
    except InputError as error:
        raise InputError(str(path), f"[boat] file {named}", error.problem, "companion boat guess writes one") from None
    parse_boat_file(text, str(named))
    said = {key: value for key, value in _raw(mission_text, str(path)).get("boat", {}).items() if key != "file"}
    return msgspec.convert({"polar": options.file, **_raw(text, str(named)).get("boat", {}), **said}, BoatOptions)


def _raw(text: str, source: str) -> dict[str, Any]:
    try:
        return tomllib.loads(text)
    except (tomllib.TOMLDecodeError, RecursionError, ValueError) as error:
        if Path(source).suffix.lower() in POLARS:
            raise InputError(
                source,
                "",
                "is a polar and no boat file",
                "companion boat guess writes one; [boat] polar of it names a polar",
            ) from None
        raise not_toml(source, text, error) from None
