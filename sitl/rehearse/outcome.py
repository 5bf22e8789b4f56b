"""What a rehearsal knows in the end, as a value and as JSON, and what its files are called."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from sitl.rehearse.known import Known, why_bad
from sitl.rehearse.pairs import Tried
from sitl.rehearse.prepared import Prepared

RESULTS, FIGURES, PICTURE, PAGE, WORST = "results.jsonl", "rehearsal.json", "rehearsal.png", "rehearsal.html", "worst"


@dataclass(frozen=True, slots=True, kw_only=True)
class Outcome:
    """What a rehearsal knows in the end; ``ends`` says why it ended, ``folders`` are those of the worst voyages."""

    known: Known
    ends: str
    changes: tuple[Tried, ...] = ()
    folders: tuple[tuple[dict[str, Any], Path | None], ...] = ()

    def to_dict(self, made: Prepared) -> dict[str, Any]:
        """Return it for JSON."""
        return {
            "mission": made.mission.name, "wind": made.doubts.wind.told, "doubt": made.doubts.boat,
            "faults": made.doubts.faults, "departs": made.scenario.begins.isoformat(),
            "limit_s": made.scenario.limit_s, "planned_s": sum(p.cost_s for p in made.plans) or None,
            "ended": self.ends, **self.known.to_dict(), "changes": [change.to_dict() for change in self.changes],
            "worst": [{"seed": record["seed"], "why": why_bad(record), "folder": folder and str(folder)}
                      for record, folder in self.folders],
            "tracks": [{"seed": record["seed"], "en_m": record.get("track", []), "nearest": record.get("nearest"),
                        "troubles": record.get("troubles", [])} for record in self.known.records]}
