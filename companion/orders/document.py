"""The verbs as a table: ``python -m companion.orders.document`` prints that of docs/guides/orders.md."""

from __future__ import annotations

import sys

from companion.orders.order import TABLE

MADE_BY = "<!-- made by python -m companion.orders.document -->"


def table() -> str:
    """Return the table of the verbs."""
    rows = [
        f"| `{row.verb}{f' {row.takes}' if row.takes else ''}` | {row.number} | {row.means} | "
        f"{'yes' if row.stands else '-'} | {row.refused} |" for row in TABLE
    ]
    head = ["| order | param1 | means | stands | refused when |", "|---|---|---|---|---|"]
    return "\n".join([MADE_BY, "", *head, *rows, ""])


if __name__ == "__main__":
    sys.stdout.write(table())
