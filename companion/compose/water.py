"""What a mission tells of the current."""

from __future__ import annotations

import datetime as dt
import math

from companion.current import STILL, Prior, read_table
from companion.current.prior import table_lines
from companion.disk import read_regular
from companion.errors import InputError, unreadable
from companion.geofence import Mission


def water_of(mission: Mission) -> Prior:
    """Return what the mission expects of the current.

    Raises:
        InputError: a table is no tide table, or set, drift and table do not go together.
    """
    current, path = mission.current, mission.tide_path
    if current is None:
        return STILL
    source = str(mission.path)
    if path is None:
        if current.drift_mps is None or (current.set_deg is None and current.drift_mps > 0.0):
            raise InputError(source, "[current]", "set_deg and drift_mps are not both there",
                             "write where it goes and how fast, or a table")
        set_rad = math.radians(current.set_deg or 0.0)
        return Prior(east_mps=current.drift_mps * math.sin(set_rad), north_mps=current.drift_mps * math.cos(set_rad),
                     sigma_mps=current.sigma_mps)
    if current.set_deg is not None or current.drift_mps is not None:
        raise InputError(source, "[current] table", "a table and a constant current exclude one another",
                         "leave out set_deg and drift_mps, or the table")
    try:
        text = read_regular(path).decode("utf-8-sig")
    except OSError as error:
        raise unreadable(source, error, f"[current] table {path}", "write a tide table beside the mission") from None
    except UnicodeDecodeError as error:
        raise InputError(str(path), "", "is no text in UTF-8", "save the tide table as text") from error
    times = tuple(_unix_s(line.split(",")[0].strip()) for _, line in table_lines(text))
    return Prior(rows=read_table(text, str(path), times), sigma_mps=current.sigma_mps, name=path.name)


def _unix_s(text: str) -> float | None:
    """Return the Unix time [s] of an ISO 8601 time with its zone, None where it is none."""
    try:
        moment = dt.datetime.fromisoformat(text)
    except ValueError:
        return None
    return None if moment.tzinfo is None else moment.timestamp()
