"""The page: a voyage in a browser, served by the companion itself, and the files that it is made of."""

from companion.page.address import Address, read_token
from companion.page.charts import Chart, open_charts
from companion.page.connections import Server
from companion.page.export import export
from companion.page.server import served
from companion.page.sources import Live, Record

__all__ = ["Address", "Chart", "Live", "Record", "Server", "export", "open_charts", "read_token", "served"]
