"""What a mission is called: by its name, or by its file's; and what is worth knowing about that."""

from __future__ import annotations

from pathlib import Path

from companion.geofence.findings import Code, Finding, Severity
from companion.words import file_name

_NAMELESS = file_name("")


def called(name: str | None, path: Path) -> str:
    """Return a mission's name; of one that has none, its file's."""
    return name if name is not None and name.strip() else path.stem


def name_findings(name: str | None, path: Path) -> tuple[Finding, ...]:
    """Return what is found about the name that a mission file gives (None: it gives none)."""
    own = called(name, path)
    stem = file_name(own)
    if name is not None and not name.strip():
        text, remedy = f"is empty: the mission is called {own!r}, as its file", "write a name, or leave the key out"
    elif "/" in own or "\\" in own or not own.isprintable() or (stem == _NAMELESS and own != stem):
        text = f"{own[:60]!r} cannot be part of a file's name: voyages and state are called {stem!r}"
        remedy = "write it with letters and digits"
    else:
        return ()
    return (Finding(severity=Severity.WARNING, code=Code.FORMAT, place="name", text=text, remedy=remedy),)
