"""Minutes since 2020 as a person reads them."""

from __future__ import annotations

from datetime import UTC, datetime


def moment(minutes: int) -> str:
    """Return a minute's date and time."""
    from companion.orders.far import unix_of

    return f"{datetime.fromtimestamp(unix_of(minutes), UTC):%Y-%m-%d %H:%M} UTC"
