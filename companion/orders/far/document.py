"""The three layouts as they stand in docs/reference/far.md: ``python -m companion.orders.far.document`` prints them."""

from __future__ import annotations

import sys

from companion.orders.far import order, status
from companion.orders.far.order import SEAL_BYTES

MADE_BY = "<!-- made by python -m companion.orders.far.document -->"


def tables() -> str:
    """Return the tables."""
    head = ["| byte | type | field | unit | not known | what |", "|---|---|---|---|---|---|"]
    parts = [MADE_BY]
    for title, layout, size in (
        ("The order", order.LAYOUT, order.SIZE), ("The beginning", order.BEGINNING_LAYOUT, order.BEGINNING_SIZE),
        ("The status", status.LAYOUT, status.SIZE),
    ):
        code = f"| {layout.size} | {SEAL_BYTES} bytes | `code` | - | - | the authentication code |"
        parts += ["", f"### {title}: {size} bytes", "", *head, *layout.rows(), code]
    return "\n".join([*parts, ""])


if __name__ == "__main__":
    sys.stdout.write(tables())
