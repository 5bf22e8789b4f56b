"""Passages: where to go in a forecast, and when; planned ashore, judged by replay, with a bound below every way.

>>> from companion.messages import GeoPoint
>>> frame = PassageFrame(GeoPoint(lat_deg=-17.0, lon_deg=179.0), GeoPoint(lat_deg=-17.0, lon_deg=-179.0))
>>> round(frame.length_m), frame.xy_from_geo(-17.0, 180.0).round(-3).tolist()
(212971, [106000.0, 0.0])
"""

from companion.passage.again import FASTER, Again, again
from companion.passage.craft import craft_of
from companion.passage.energy import Energy, left_wh
from companion.passage.frame import PassageFrame
from companion.passage.kernels import Craft
from companion.passage.land import Land, land_of
from companion.passage.plan import Outcome, Passage, Route, plan
from companion.passage.replay import Sailed, sail
from companion.passage.sweep import SURE, Departure, at_least, at_most, best, shares_of, shown, sweep

__all__ = [
    "FASTER",
    "SURE",
    "Again",
    "Craft",
    "Departure",
    "Energy",
    "Land",
    "Outcome",
    "Passage",
    "PassageFrame",
    "Route",
    "Sailed",
    "again",
    "at_least",
    "at_most",
    "best",
    "craft_of",
    "land_of",
    "left_wh",
    "plan",
    "sail",
    "shares_of",
    "shown",
    "sweep",
]
