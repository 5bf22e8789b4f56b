"""The track of a plan: what is expected of it, its corners made few and followable, its floor kept."""

from companion.planner.track.expected import ExpectedTrack, expected
from companion.planner.track.kept import with_track

__all__ = ["ExpectedTrack", "expected", "with_track"]
