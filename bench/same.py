"""Is the boat's voyage still the same, byte for byte?  ``python -m bench.same [COMMIT]`` (default: HEAD)

Eight scenarios (a beat, ships, an AIS fleet, a fault, a kill, a field, buoys, a failsafe) are sailed by the commit's
own code, in a folder of its own, and by the working tree's; track and telemetry log must be the same bytes. Run it
over a change that moves code and is to change nothing else. Exit code 1 when a voyage differs.
"""

from __future__ import annotations

import argparse
import hashlib
import os
import subprocess
import sys
import tempfile
from pathlib import Path

SCENARIOS = ("demo", "crossing", "four-ships", "gps-jump", "killed", "two-boats-by-field", "buoy-course", "fence-hold")
FILES = ("track.csv", "telemetry.tlog")
HERE = Path(__file__).resolve().parent.parent


def sailed(root: Path, scenario: str, folder: Path) -> dict[str, str]:
    """Sail a scenario with the code under ``root``; return {file below the voyage folder: SHA-256}."""
    voyage = folder / scenario
    argv = [sys.executable, "-c", "import sys; from sitl.cli import main; sys.exit(main())"]
    subprocess.run(  # a verdict of "failed" is the same voyage too: only the bytes are compared
        [*argv, "run", f"sitl/scenarios/{scenario}.toml", "--seed", "0", "--out", str(voyage)],
        cwd=root,
        env={**os.environ, "PYTHONPATH": str(root), "PYTHONSAFEPATH": "1"},
        stdout=subprocess.DEVNULL,
        check=False,
    )
    files = sorted(path for path in voyage.rglob("*") if path.name in FILES)
    return {str(path.relative_to(voyage)): hashlib.sha256(path.read_bytes()).hexdigest() for path in files}


def main() -> int:
    """Sail both; print a line a scenario."""
    parser = argparse.ArgumentParser(prog="python -m bench.same", description=__doc__)
    parser.add_argument("commit", nargs="?", default="HEAD")
    args = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        before, then, now = Path(folder, "commit"), Path(folder, "then"), Path(folder, "now")
        for path in (before, then, now):
            path.mkdir()
        archive = subprocess.run(["git", "archive", args.commit], cwd=HERE, stdout=subprocess.PIPE, check=True)
        subprocess.run(["tar", "-x", "-C", str(before)], input=archive.stdout, check=True)
        differing = 0
        for scenario in SCENARIOS:
            old, new = sailed(before, scenario, then), sailed(HERE, scenario, now)
            same = bool(old) and old == new
            differing += not same
            wrong = [name for name in sorted({*old, *new}) if old.get(name) != new.get(name)] or ["no voyage"]
            said = f"same     {scenario}, {len(new)} files" if same else f"DIFFERS  {scenario}: {', '.join(wrong)}"
            print(said, flush=True)
    return 1 if differing else 0


if __name__ == "__main__":
    sys.exit(main())
