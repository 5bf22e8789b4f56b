"""A mission: goals, area and options, read from TOML, made from drawings, checked before anything believes it."""

from companion.geofence.mission.files import MissionFiles, document_of, goal_losses, mission_files, zones_only
from companion.geofence.mission.mission import load_mission
from companion.geofence.mission.options import AreaOptions, WindOptions

__all__ = [
    "AreaOptions", "MissionFiles", "WindOptions", "document_of", "goal_losses", "load_mission", "mission_files",
    "zones_only",
]
