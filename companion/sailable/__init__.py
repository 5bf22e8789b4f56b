"""Whether a mission can be sailed as it stands, and what plans of it would be: for who checks, draws or sails it."""

from companion.sailable.judging import Judged, judge, require_sailable

__all__ = ["Judged", "judge", "require_sailable"]
