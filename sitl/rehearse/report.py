"""The outcome of a rehearsal: as a value, as JSON, and as a page of one file.

It stands by itself: the live page and the viewer show one voyage, moment by moment, and thousands of voyages have no
moment in common. Its worst voyages are the viewer's own pages.
"""

from __future__ import annotations

import base64
import html
import sys
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from companion.commands.view import read_record
from companion.disk import Disk
from companion.page import export
from companion.program import control
from companion.words import counted
from sitl.rehearse.changes import TOLD, Tried, difference_text, is_sure, scaled
from sitl.rehearse.estimates import Estimates, Share, between, percent, reached, why_bad
from sitl.rehearse.prepared import PreparedRehearsal
from sitl.results import FigureChange as Difference

RESULTS, FIGURES, PICTURE, PAGE, WORST = "results.jsonl", "rehearsal.json", "rehearsal.png", "rehearsal.html", "worst"


@dataclass(frozen=True, slots=True, kw_only=True)
class RehearsalOutcome:
    """What a rehearsal knows in the end; ``ends`` says why it ended, ``folders`` are those of the worst voyages."""

    known: Estimates
    ends: str
    changes: tuple[Tried, ...] = ()
    folders: tuple[tuple[dict[str, Any], Path | None], ...] = ()

    def to_dict(self, made: PreparedRehearsal) -> dict[str, Any]:
        """Return it for JSON."""
        return {
            "mission": made.mission.name,
            "wind": made.doubts.wind.told,
            "doubt": made.doubts.boat,
            "faults": made.doubts.faults,
            "departs": made.scenario.begins.isoformat(),
            "limit_s": made.scenario.limit_s,
            "planned_s": made.planned_s or None,
            "ended": self.ends,
            **self.known.to_dict(),
            "changes": [change.to_dict() for change in self.changes],
            "worst": [
                {"seed": record["seed"], "why": why_bad(record), "folder": folder and str(folder)}
                for record, folder in self.folders
            ],
            "tracks": [
                {
                    "seed": record["seed"],
                    "en_m": record.get("track", []),
                    "nearest": record.get("nearest"),
                    "troubles": record.get("troubles", []),
                }
                for record in self.known.records
            ],
        }


STYLE = """
:root{color-scheme:light dark;--ink:#1b2a38;--paper:#fff;--line:#c6d2db;--sure:#1b7f3b;--bad:#b3261e}
@media (prefers-color-scheme:dark){:root{--ink:#dfe8ee;--paper:#10181f;--line:#33475a;--sure:#58c07c;--bad:#ff8a80}}
body{font:16px/1.45 system-ui,sans-serif;color:var(--ink);background:var(--paper)}
body{max-width:72rem;margin:auto;padding:1rem}table{border-collapse:collapse;margin:.5rem 0 1.5rem}
td,th{border-bottom:1px solid var(--line);padding:.3rem .8rem;text-align:left}
td.n{text-align:right;font-variant-numeric:tabular-nums}img{max-width:100%;background:#fff}
@media (prefers-color-scheme:dark){img{filter:invert(1) hue-rotate(180deg)}}
.good{color:var(--sure)}.bad{color:var(--bad)}.quiet{opacity:.65}a{color:inherit}
"""


def page_of(made: PreparedRehearsal, outcome: RehearsalOutcome, folder: Path, *, is_whole: bool = True) -> bytes:
    """Return the page; the worst voyages' own pages are written beside their folders.

    One that is not whole yet has no picture, and is looked at again by itself.

    Raises:
        OSError: the disk does not take them.
    """
    known = outcome.known
    name = html.escape(made.mission.name)
    picture = ""
    if is_whole and (folder / PICTURE).is_file():
        data = base64.b64encode((folder / PICTURE).read_bytes()).decode()
        picture = f"<img alt='Map of the voyages, chances, times, changes' src='data:image/png;base64,{data}'>"
    head = (
        "<!doctype html><html lang=en><meta charset=utf-8><meta name=viewport content='width=device-width'>"
        f"<title>{name}, rehearsed</title><link rel=icon href='data:,'><style>{STYLE}</style>"
        f"{'' if is_whole else '<meta http-equiv=refresh content=10>'}"
    )
    asked = (
        f"<h1>{name}, rehearsed</h1><p>{counted(len(known.records), 'voyage')}, {html.escape(outcome.ends)}. Wind: "
        f"{html.escape(made.doubts.wind.told)}. Doubt in boat, sea and sensors: {made.doubts.boat:g}; "
        f"{'with' if made.doubts.faults else 'without'} trouble. In brackets what is 95 % sure.</p>"
    )
    parts = [
        head,
        asked,
        _chances(known),
        picture,
        _changes(outcome.changes),
        "<h2>The worst</h2><table>",
        *_worst(outcome, folder),
        "</table>",
    ]
    return "\n".join(parts).encode()


def _chances(known: Estimates) -> str:
    rows = [
        _row(words, _cell(share))
        for words, share in (
            ("arrives", known.arrives),
            ("comes below the margin's floor", known.low),
            ("touches something", known.touches),
        )
    ]
    rows += [_row(reached(time), f"<span class=quiet>({between(time)})</span>") for time in known.times]
    rows += [_row(html.escape(watchdog), _cell(share)) for watchdog, share in known.watchdogs.items()]
    return f"<h2>What will happen</h2><table>{''.join(rows)}</table>"


def _cell(share: Share) -> str:
    return f"{share.came} of {share.of} <span class=quiet>({percent(share)})</span>"


def _row(*cells: str) -> str:
    return "<tr>" + "".join(f"<td{' class=n' if n else ''}>{cell}</td>" for n, cell in enumerate(cells))


def _changes(changes: Sequence[Tried]) -> str:
    if not changes:
        return ""
    head = "".join(f"<th>{name}" for name in ("with", "pairs", *TOLD))
    rows = []
    for pair in changes:
        found = {change.measure.name: change for change in pair.comparison.changes}
        rows.append(
            _row(
                html.escape(pair.change.told),
                str(len(pair.comparison.pairs)),
                *(_difference(found[name]) if name in found else "" for name in TOLD),
            )
        )
    return (
        "<h2>What to change</h2><p>The same seeds with it and without. Green and red are differences that the "
        f"pairs leave no doubt of.</p><table><tr>{head}{''.join(rows)}</table>"
    )


def _difference(change: Difference) -> str:
    kind = "quiet"
    if is_sure(change):
        kind = "bad" if (scaled(change)[1] > 0.0) == (change.measure.worse > 0) else "good"
    return f"<span class={kind}>{difference_text(change)}</span>"


def _worst(outcome: RehearsalOutcome, folder: Path) -> Iterable[str]:
    for record, place in outcome.folders:
        link = ""
        if place is not None:
            control(sys.stderr, f"\rits page: seed {record['seed']}   ")
            file = place.with_suffix(".html")
            Disk().replace(file, export(read_record(place)))
            link = f"<a href='{html.escape(str(file.relative_to(folder)))}'>look at it</a>"
        yield _row(f"seed {record['seed']}", html.escape(why_bad(record)), link)
    if outcome.folders:
        sys.stderr.write("\n")
