"""What the obstacles of a chart were made for: how much water a keel needs, which tide, where what dries is.

``companion chart import`` writes it into its GeoJSON as the member ``made_for``: a later mission with another keel, of
another day, or without the file of what dries would find free what is not.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

MEMBER = "made_for"


@dataclass(frozen=True, slots=True, kw_only=True)
class Charted:
    """What is free in a file of obstacles.

    Attributes:
        needs_m: the water [m] that it has at least, with ``tide_m``: the keel's, and the room under it.
        tide_m: the height of the tide above the chart's datum [m] that is reckoned with.
        hours_s: the Unix times [s] between which it stands as high at least; None: it is not reckoned with.
        drying: the file of what is too shallow at some hours only, which is left out of this one; "": nothing is.
        source: the file.
    """

    needs_m: float
    tide_m: float = 0.0
    hours_s: tuple[float, float] | None = None
    drying: str = ""
    source: str = ""

    def to_dict(self) -> dict[str, object]:
        """Return it as the file has it."""
        found: dict[str, object] = {"needs_m": round(self.needs_m, 3)}
        if self.hours_s is not None:
            begins, ends = (np.datetime_as_string(np.datetime64(round(t), "s")) for t in self.hours_s)
            found |= {"tide_m": round(self.tide_m, 3), "from": f"{begins}Z", "to": f"{ends}Z"}
        return found | ({"drying": self.drying} if self.drying else {})
