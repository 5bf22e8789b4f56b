"""The page: a voyage in a browser, served by the companion itself, and the files that it is made of."""

from companion.page.charts import TileChart, is_tiles, open_charts
from companion.page.connections import (
    Address,
    Guests,
    HttpRefusal,
    HttpReply,
    Stream,
    listening,
    read_token,
    require_token,
)
from companion.page.passages import read_passage, read_planned
from companion.page.server import export, files, served, tile_at
from companion.page.sources import LiveSource, RecordedSource, plan_figures

__all__ = [
    "Address",
    "Guests",
    "HttpRefusal",
    "HttpReply",
    "LiveSource",
    "RecordedSource",
    "Stream",
    "TileChart",
    "export",
    "files",
    "is_tiles",
    "listening",
    "open_charts",
    "plan_figures",
    "read_passage",
    "read_planned",
    "read_token",
    "require_token",
    "served",
    "tile_at",
]
