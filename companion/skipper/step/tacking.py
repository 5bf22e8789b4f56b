"""What the voyage's own tacks tell: how many were tried, how many failed, and the chance that the next one does.

The mission's chance counts as ``PRIOR_TACKS`` tacks that were seen: a Beta distribution, to which each tack adds. Its
mean is the probability that the next tack fails.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

PRIOR_TACKS = 5.0    # so many of the voyage's own say as much as the mission


@dataclass(frozen=True, slots=True, kw_only=True)
class Tacking:
    """Tacks seen, and the one that is under way.

    Attributes:
        tried, failed: of this voyage.
        in_a_row: failures since the last that came off.
        failed_s: when the last failed.
        side: of the wind when she was last settled on a tack: 1 starboard, -1 port, 0 never.
        settled_rad: her heading then, and ``settled_s`` when.
        settled_mps: her speed then.
        slowest_mps: the least since the tack that is being tried began.
        began_s: since when a tack is being tried, None: none is.
        is_counted: that one was counted as failed: she lies in irons.
        began_en_m: where she was then, None: not known.
        irons_s: the longest that she has lain.
        starboard_lee_mps, port_lee_mps: the fastest that she was set then, abeam to the lee of that tack, beside the
            current that is believed.

    """

    tried: int = 0
    failed: int = 0
    in_a_row: int = 0
    failed_s: float = -math.inf
    side: int = 0
    settled_rad: float = 0.0
    settled_s: float = -math.inf
    settled_mps: float = 0.0
    slowest_mps: float = math.inf
    began_s: float | None = None
    is_counted: bool = False
    began_en_m: tuple[float, float] | None = None
    irons_s: float = 0.0
    starboard_lee_mps: float = 0.0
    port_lee_mps: float = 0.0

    def chance(self, given: float) -> float:
        """Return the chance that the next tack fails; ``given`` is the mission's, and 0 asks for none."""
        return 0.0 if given <= 0.0 else (given * PRIOR_TACKS + self.failed) / (PRIOR_TACKS + self.tried)

    def spread(self, given: float) -> float:
        """Return the standard deviation of that chance."""
        mean = self.chance(given)
        return math.sqrt(mean * (1.0 - mean) / (PRIOR_TACKS + self.tried + 1.0))


NO_TACKS = Tacking()
