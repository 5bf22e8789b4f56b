"""The page: a voyage in a browser, served by the companion itself, and the files that it is made of."""

from companion.page.address import Address, read_token
from companion.page.charts import Chart, open_charts
from companion.page.connections import Guests, Refused, Reply, Server, Stream, listening, require_token
from companion.page.export import export
from companion.page.figures import plan_figures
from companion.page.server import served, tile_at
from companion.page.site import files
from companion.page.sources import Live, Record

__all__ = [
    "Address", "Chart", "Guests", "Live", "Record", "Refused", "Reply", "Server", "Stream", "export", "files",
    "listening", "open_charts", "plan_figures", "read_token", "require_token", "served", "tile_at",
]
