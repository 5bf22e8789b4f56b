"""The view of a voyage: one typed value and its JSON, from a live step, a recorded voyage or what a radio brings.

``ViewFold(voyage, config).take(step, ...)`` aboard, ``recorded_views(folder)`` afterwards, ``HeardFold().take(...)``
ashore; all give a ``View`` and the ``Event``s that led to it.
"""

from companion.view.area import AreaView
from companion.view.events import Event
from companion.view.fold import ViewFold
from companion.view.heard import HeardFold
from companion.view.recorded import recorded_views
from companion.view.values import SCHEMA, FigureView, Past, Trail, View, WindView, sample_of

__all__ = [
    "SCHEMA",
    "AreaView",
    "Event",
    "FigureView",
    "HeardFold",
    "Past",
    "Trail",
    "View",
    "ViewFold",
    "WindView",
    "recorded_views",
    "sample_of",
]
