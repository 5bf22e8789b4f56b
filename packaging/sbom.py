"""The bill of materials: ``python3 packaging/sbom.py LOCK`` writes CycloneDX 1.5 (JSON) of a lock to standard output.

Made of names, versions and digests as the lock has them; a library with two versions is there twice.
"""

import json
import re
import sys
import uuid
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]


def components(lock: str) -> list[dict[str, object]]:
    """Return the libraries of a lock."""
    out: list[dict[str, object]] = []
    for line in lock.replace("\\\n", " ").splitlines():
        found = re.match(r"([A-Za-z0-9._-]+)==([^\s;]+)(?: ; (.*?))?\s+--hash", line)
        if found is None:
            continue
        name, version, marker = found.groups()
        component: dict[str, object] = {
            "type": "library",
            "name": name,
            "version": version,
            "purl": f"pkg:pypi/{name}@{version}",
            "bom-ref": f"{name}@{version}",
            "hashes": [{"alg": "SHA-256", "content": digest} for digest in re.findall(r"sha256:([0-9a-f]{64})", line)],
        }
        if marker:
            component["properties"] = [{"name": "python:marker", "value": marker}]
        out.append(component)
    return out


def bill(lock: Path) -> dict[str, object]:
    """Return the bill of materials."""
    version = re.search(r'__version__ = "(.+)"', (ROOT / "companion/__init__.py").read_text())[1]
    text = lock.read_text()
    return {
        "bomFormat": "CycloneDX",
        "specVersion": "1.5",
        "version": 1,
        "serialNumber": f"urn:uuid:{uuid.uuid5(uuid.NAMESPACE_OID, version + text)}",
        "metadata": {
            "component": {
                "type": "application",
                "name": "sailboat-companion",
                "version": version,
                "purl": f"pkg:pypi/sailboat-companion@{version}",
            }
        },
        "components": components(text),
    }


if __name__ == "__main__":
    json.dump(bill(Path(sys.argv[1])), sys.stdout, indent=1)
    sys.stdout.write("\n")
