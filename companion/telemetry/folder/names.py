"""What the files of a voyage's folder are called."""

from __future__ import annotations

DECISIONS = "decisions.jsonl"
TRACK = "track.csv"
TLOG = "telemetry.tlog"
SUMMARY = "summary.json"
VOYAGE = "voyage.toml"
AREA = "area.json"
STATE = "state.json"
PICTURE = "voyage.png"
VERDICT = "verdict.json"    # of a scenario
COPIES = "mission"          # the mission as it is sailed, with the files that it names
