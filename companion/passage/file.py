"""A passage's file: what is asked, as TOML. Its ``[boat]`` and ``[area]`` are those of a mission."""

from __future__ import annotations

import datetime as dt
import difflib
import math
import re
import tomllib
from typing import Annotated, Any

import msgspec
from msgspec import Meta, Struct

from companion.errors import InputError, not_toml
from companion.geofence.mission import AreaOptions, BoatOptions, Latitude, Longitude
from companion.words import expected


class PlaceOptions(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """``[start]``: where she is."""

    lat: Latitude
    lon: Longitude


class GoalOptions(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """``[goal]``: where she is to be."""

    lat: Latitude
    lon: Longitude
    radius_m: Annotated[float, Meta(ge=1.0, le=100_000.0)] = 1000.0
    """She is there within so far of it."""
    name: str = "goal"


class DepartOptions(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """``[depart]``: when she sets sail."""

    at: Annotated[dt.datetime, Meta(tz=True)]
    by: Annotated[dt.datetime, Meta(tz=True)] | None = None
    """She is to be there by then; `--by` counts before it."""
    sure: Annotated[float, Meta(gt=0.0, lt=1.0)] = 0.9
    """With this chance, by the members of the forecast and her doubtful speed; of routes so sure the fastest counts."""


class WeatherOptions(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """``[weather]``: the forecasts, beside the passage's file; wind and, where they have it, the current."""

    files: Annotated[tuple[str, ...], Meta(min_length=1)]
    error_mps: Annotated[float, Meta(ge=0.0, le=20.0)] = 0.0
    """The deviation of a component of the wind from what a member says, at the time of its run ..."""
    error_mps_per_day: Annotated[float, Meta(ge=0.0, le=20.0)] = 0.0
    """... and what each day ahead adds to it: `companion weather error` tells both of successive runs."""


class ClimateOptions(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """``[climate]``: the wind of the season, in which she sails past the forecast's end."""

    from_deg: Annotated[float, Meta(ge=0.0, le=360.0)]
    mean_mps: Annotated[float, Meta(ge=0.0, le=60.0)]
    """Of the vectors: where it blows from everywhere, little."""
    spread_mps: Annotated[float, Meta(ge=0.0, le=30.0)]
    days: Annotated[float, Meta(gt=0.0, le=60.0)] = 20.0


class SailingOptions(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """``[sailing]``: how she is sailed over days."""

    board_m: Annotated[float, Meta(ge=100.0, le=1e6)] = 10_000.0
    """The length of a board of a beat, after which a tack costs ``[boat] tack_loss_s``."""
    night_share: Annotated[float, Meta(ge=0.0, le=1.0)] = 1.0
    """Of her speed, how much she sails at when the sun is more than 6 degrees down; 0: she heaves to."""


class LimitOptions(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """``[limits]``: what she is not to be out in, beside ``[boat] max_tws_mps``."""

    max_wave_m: Annotated[float, Meta(gt=0.0, le=40.0)] | None = None
    """The significant height of the sea; the forecasts must say it."""
    lee_shore_m: Annotated[float, Meta(gt=0.0, le=200_000.0)] | None = None
    """So near to a shore ([area] obstacles, with its margin) ..."""
    lee_tws_mps: Annotated[float, Meta(gt=0.0, le=60.0)] = 8.0
    """... no more than this is to blow towards it."""


class EnergyOptions(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """``[energy]``: what is in the battery, what comes and what goes; a run that is down to its reserve ends there."""

    battery_wh: Annotated[float, Meta(gt=0.0, le=1e6)]
    start_percent: Annotated[float, Meta(ge=0.0, le=100.0)] = 100.0
    reserve_percent: Annotated[float, Meta(ge=0.0, le=100.0)] = 20.0
    solar_w: Annotated[float, Meta(ge=0.0, le=1e5)] = 0.0
    """With the sun overhead, of a mean sky."""
    day_w: Annotated[float, Meta(ge=0.0, le=1e5)]
    night_w: Annotated[float, Meta(ge=0.0, le=1e5)] | None = None
    """With the sun more than 6 degrees down; as by day where it is not said."""


class PassageFile(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """A file of ``companion passage``."""

    name: str = ""
    start: PlaceOptions
    goal: GoalOptions
    depart: DepartOptions
    weather: WeatherOptions
    boat: BoatOptions = BoatOptions()
    area: AreaOptions = AreaOptions()
    sailing: SailingOptions = SailingOptions()
    limits: LimitOptions = LimitOptions()
    energy: EnergyOptions | None = None
    climate: ClimateOptions | None = None


def parse_passage(text: str, source: str) -> PassageFile:
    """Return the passage of a TOML text. Raises InputError: the key, what is wrong with it, and the nearest known."""
    if not text.strip():
        raise InputError(source, "", "is empty", "write [start], [goal] and [depart]: companion passage --help")
    try:
        raw = tomllib.loads(text)
    except (tomllib.TOMLDecodeError, RecursionError, ValueError) as error:
        raise not_toml(source, text, error) from None
    if isinstance(raw.get("goal"), list):
        raise InputError(
            source, "", "is a mission, not a passage: it has [[goal]]", f"check it by: companion mission check {source}"
        )
    for table, keys in raw.items():
        for key, value in keys.items() if isinstance(keys, dict) else ():
            if isinstance(value, float) and not math.isfinite(value):
                raise InputError(source, f"[{table}] {key}", f"{value} is not a finite number")
    try:
        found = msgspec.convert(raw, PassageFile)
    except msgspec.ValidationError as error:
        raise _refusal(str(error), source) from None
    at, by = found.depart.at, found.depart.by
    if by is not None and by <= at:
        raise InputError(source, "[depart] by", "is not after at, when she departs", "write a later time")
    return found


def _refusal(message: str, source: str) -> InputError:
    problem, _, path = message.partition(" - at `$.")
    table, _, key = path.rstrip("`").partition(".")
    place = f"[{table}] {key}".strip() if table else ""
    unknown = re.search(r"unknown field `(.+)`", problem)
    if unknown:
        kind: Any = {field.name: field.type for field in msgspec.structs.fields(PassageFile)}.get(table, PassageFile)
        known = kind.__struct_fields__
        near = difflib.get_close_matches(unknown[1], known, n=1, cutoff=0.5)
        remedy = f"did you mean {near[0]!r}?" if near else "known keys: " + ", ".join(known)
        return InputError(source, f"{place} {unknown[1]}".strip(), "unknown key", remedy)
    missing = re.search(r"missing required field `(.+)`", problem)
    if missing:
        return InputError(
            source, f"{place} {missing[1]}".strip() if table else f"[{missing[1]}]", "is missing", "add it"
        )
    return InputError(source, place, expected(problem))
