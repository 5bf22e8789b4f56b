"""Whether a mission can be sailed as it stands, and what plans of it would be: for who checks, draws or sails it."""

from companion.sailable.judging import Judged, judge, require_sailable
from companion.sailable.waters import words_of

__all__ = ["Judged", "judge", "require_sailable", "words_of"]
