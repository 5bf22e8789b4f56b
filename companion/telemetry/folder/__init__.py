"""The folder that a voyage leaves: what is written while it is sailed, and read again."""

from companion.telemetry.folder.logbook import Logbook
from companion.telemetry.folder.names import DECISIONS, PICTURE, STATE, TLOG, TRACK, VERDICT, VOYAGE
from companion.telemetry.folder.reading import (
    Chart,
    RecordedPlan,
    VoyageRecord,
    believed,
    read_decisions,
    read_description,
    read_rows,
    read_voyage,
    require_files,
)
from companion.telemetry.folder.recorder import Recorder, jsonable
from companion.telemetry.folder.records import action_record, ais_of, ais_record, order_record, outcome_record
from companion.telemetry.folder.segments import is_from_the_start, parts
from companion.telemetry.folder.shelf import DEFAULT_BUDGET_BYTES, Shelf
from companion.telemetry.folder.summary import VoyageFigures

__all__ = [
    "DECISIONS", "DEFAULT_BUDGET_BYTES", "PICTURE", "STATE", "TLOG", "TRACK", "VERDICT", "VOYAGE", "Chart", "Logbook",
    "RecordedPlan", "Recorder", "Shelf", "VoyageFigures", "VoyageRecord", "action_record", "ais_of", "ais_record",
    "believed", "is_from_the_start", "jsonable", "order_record", "outcome_record", "parts", "read_decisions",
    "read_description", "read_rows", "read_voyage", "require_files",
]
