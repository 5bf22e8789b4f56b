"""The folder that a voyage leaves: what is written while it is sailed, and read again."""

from companion.telemetry.folder.logbook import Logbook
from companion.telemetry.folder.reading import (
    RecordedChart,
    RecordedPlan,
    VoyageRecord,
    believed,
    read_decisions,
    read_description,
    read_rows,
    read_voyage,
    require_files,
)
from companion.telemetry.folder.recorder import (
    DECISIONS,
    DEFAULT_BUDGET_BYTES,
    PICTURE,
    STATE,
    SUMMARY,
    TLOG,
    TRACK,
    VERDICT,
    VOYAGE,
    Recorder,
    VoyageArchive,
    is_from_the_start,
    jsonable,
    parts,
)
from companion.telemetry.folder.records import (
    VoyageFigures,
    action_record,
    ais_of,
    ais_record,
    fence_record,
    order_record,
    outcome_record,
)

__all__ = [
    "DECISIONS", "DEFAULT_BUDGET_BYTES", "PICTURE", "STATE", "SUMMARY", "TLOG", "TRACK", "VERDICT", "VOYAGE", "Logbook",
    "RecordedChart", "RecordedPlan", "Recorder", "VoyageArchive", "VoyageFigures", "VoyageRecord", "action_record",
    "ais_of", "ais_record", "believed", "fence_record", "is_from_the_start", "jsonable", "order_record",
    "outcome_record", "parts", "read_decisions", "read_description", "read_rows", "read_voyage", "require_files",
]
