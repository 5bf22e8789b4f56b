"""The page: a voyage in a browser, served by the companion itself, and the files that it is made of."""

from companion.page.charts import Chart, open_charts
from companion.page.connections import (
    Address,
    Guests,
    Refused,
    Reply,
    Server,
    Stream,
    listening,
    read_token,
    require_token,
)
from companion.page.server import served, tile_at
from companion.page.site import export, files
from companion.page.sources import Live, Record, plan_figures

__all__ = [
    "Address", "Chart", "Guests", "Live", "Record", "Refused", "Reply", "Server", "Stream", "export", "files",
    "listening", "open_charts", "plan_figures", "read_token", "require_token", "served", "tile_at",
]
