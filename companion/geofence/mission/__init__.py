"""A mission: goals, area and options, read from TOML, made from drawings, checked before anything believes it."""

from companion.geofence.mission.autopilot_mission import (
    NO_NAME,
    DrawnMission,
    drawing_of,
    drawn_mission,
    hindrance,
    kept,
    offer,
    read_kept,
)
from companion.geofence.mission.boat_file import BoatFile, parse_boat_file, read_boat_file
from companion.geofence.mission.files import PERMITS, MissionFiles, document_of, goal_losses, mission_files, zones_only
from companion.geofence.mission.goals import GoalField, GoalGate, free_water, is_file
from companion.geofence.mission.mission import load_area, load_mission, load_settings, place_troubles, read_mission
from companion.geofence.mission.options import (
    AreaOptions,
    AtomOptions,
    BoxOptions,
    CircleAtomOptions,
    FieldOptions,
    GateOptions,
    GoalOptions,
    HeadingAtomOptions,
    Latitude,
    LeaveAtomOptions,
    LineAtomOptions,
    Longitude,
    MarkOptions,
    MissionOptions,
    PointAtomOptions,
    PointOptions,
    RefugeOptions,
    RepulsiveLineAtomOptions,
    RepulsivePointAtomOptions,
    SearchOptions,
    StartOptions,
    StationAtomOptions,
    WindOptions,
    kind_of,
)
from companion.geofence.mission.text import parse_options, read_options, toml, without_defaults

__all__ = [
    "NO_NAME", "PERMITS", "AreaOptions", "AtomOptions", "BoatFile", "BoxOptions", "CircleAtomOptions", "DrawnMission",
    "FieldOptions", "GateOptions", "GoalField", "GoalGate", "GoalOptions", "HeadingAtomOptions", "Latitude",
    "LeaveAtomOptions", "LineAtomOptions", "Longitude", "MarkOptions", "MissionFiles", "MissionOptions",
    "PointAtomOptions", "PointOptions", "RefugeOptions", "RepulsiveLineAtomOptions", "RepulsivePointAtomOptions",
    "SearchOptions", "StartOptions", "StationAtomOptions", "WindOptions", "document_of", "drawing_of", "drawn_mission",
    "free_water", "goal_losses", "hindrance", "is_file", "kept", "kind_of", "load_area", "load_mission",
    "load_settings", "mission_files", "offer", "parse_boat_file", "parse_options", "place_troubles", "read_boat_file",
    "read_kept", "read_mission", "read_options", "toml", "without_defaults", "zones_only",
]
