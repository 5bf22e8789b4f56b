"""docs/watchdogs.md, made from the table of watchdogs: ``python -m companion.skipper.document > docs/watchdogs.md``."""

from __future__ import annotations

import sys

from companion.skipper.watchdogs import TABLE


def markdown() -> str:
    """Return docs/watchdogs.md."""
    rows = [
        "# Watchdogs",
        "",
        "Made from the table in `companion/skipper/watchdogs.py` by `python -m companion.skipper.document`; a test",
        "checks that it is current. A watchdog is raised when its figure has been at or beyond the entry threshold",
        "for the time given, and cleared when it has been at or beyond the exit threshold (or cannot be told) for its",
        "time.",
        "Those marked * are watched before the boat sails, too.",
        "",
        "| watchdog | watches | entry | exit | says | then | why |",
        "|---|---|---|---|---|---|---|",
    ]
    for dog in TABLE:
        sign, back = ("≥", "≤") if dog.enter >= dog.exit else ("≤", "≥")
        unit = f" {dog.unit}" if dog.unit else ""
        rows.append(" | ".join((
            f"| {dog.name}{'*' if dog.at_rest else ''}", dog.watches,
            f"{sign} {dog.enter:g}{unit} for {dog.enter_s:g} s",
            f"{back} {dog.exit:g}{unit} for {dog.exit_s:g} s", dog.severity.name.lower(), dog.response.value,
            f"{dog.why} |",
        )))
    return "\n".join(rows) + "\n"


if __name__ == "__main__":
    sys.stdout.write(markdown())
