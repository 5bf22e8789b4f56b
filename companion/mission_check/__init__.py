"""Whether a mission can be sailed as it stands, and what plans of it would be: for who checks, draws or sails it."""

from companion.mission_check.check import CheckedMission, charted_findings, check_mission
from companion.mission_check.fields import (
    FieldPreview,
    HeadingFan,
    field_preview,
    field_track,
    heading_fan,
    without_value,
)
from companion.mission_check.legs import (
    AssumedWind,
    continued_plans,
    expected_current,
    layline_rad,
    leg_names,
    leg_problem,
    legs,
    planned_legs,
    waits_s,
)
from companion.mission_check.sailable import require_sailable
from companion.mission_check.words import (
    current_words_of,
    is_of_unknown_length,
    margin_words,
    passage_words,
    tide_words_of,
    wait_words,
    wind_limit_words,
)

__all__ = [
    "AssumedWind",
    "CheckedMission",
    "FieldPreview",
    "HeadingFan",
    "charted_findings",
    "check_mission",
    "continued_plans",
    "current_words_of",
    "expected_current",
    "field_preview",
    "field_track",
    "heading_fan",
    "is_of_unknown_length",
    "layline_rad",
    "leg_names",
    "leg_problem",
    "legs",
    "margin_words",
    "passage_words",
    "planned_legs",
    "require_sailable",
    "tide_words_of",
    "wait_words",
    "waits_s",
    "wind_limit_words",
    "without_value",
]
