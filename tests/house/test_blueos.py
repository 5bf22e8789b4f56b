"""The extension of BlueOS: labels as its documents ask for them, and a start script that starts the companion."""

import json
import os
import re
import signal
import subprocess
import sys
import time
import urllib.request
from pathlib import Path

import pytest

import companion.cli
from sitl.scenario import free_port

ROOT = Path(__file__).resolve().parents[2]
FOLDER = ROOT / "packaging/blueos"
# What the extensions' repository knows: github.com/bluerobotics/BlueOS-Extensions-Repository
KINDS = {"device-integration", "example", "theme", "other", "tool"}


def instructions():
    """The Dockerfile's instructions, each in one line."""
    text = re.sub(r"^#.*\n", "", (FOLDER / "Dockerfile").read_text(), flags=re.MULTILINE).replace("\\\n", "")
    return [tuple(line.split(maxsplit=1)) for line in text.splitlines() if line.strip()]


def labels():
    found = {}
    for word, rest in instructions():
        if word == "LABEL":
            name, _, value = rest.partition("=")
            assert (value[0], value[-1]) in {("'", "'"), ('"', '"')}
            found[name] = value[1:-1]
    return found


def test_the_labels_are_what_blueos_reads():
    said = labels()
    assert set(said) >= {"version", "permissions", "authors", "company", "readme", "type", "tags", "links"}
    assert said["version"] == "${VERSION}"  # which has one place
    assert said["type"] in KINDS
    assert all(set(author) == {"name", "email"} for author in json.loads(said["authors"]))
    assert {"name", "about", "email"} <= set(json.loads(said["company"]))
    assert all(re.fullmatch(r"https://\S+|mailto:\S+@\S+", link) for link in json.loads(said["links"]).values())
    assert "{tag}" in said["readme"]
    tags = json.loads(said["tags"])
    assert 0 < len(tags) <= 10
    assert all(re.fullmatch(r"[a-z0-9-]+", tag) for tag in tags)


def test_the_permissions_are_of_a_container_and_no_more_than_needed():
    asked = json.loads(labels()["permissions"])
    assert set(asked) == {"HostConfig", "Env"}
    host = asked["HostConfig"]
    assert host["NetworkMode"] == "host"  # BlueOS's router listens to this machine alone
    assert "Privileged" not in host
    assert [bind.split(":")[1:] for bind in host["Binds"]] == [["/data", "rw"]]
    named = {entry.partition("=")[0] for entry in asked["Env"]}
    assert named == set(re.findall(r"\$\{(\w+):-", (FOLDER / "start-companion").read_text())) - {"DATA"}


def test_what_the_dockerfile_copies_and_starts_is_there():
    done = instructions()
    copied = [rest.split() for word, rest in done if word == "COPY"]
    ours = [(ROOT / source, target) for source, target in copied if not source.startswith("dist/")]
    assert all(source.is_file() for source, _ in ours)
    entry = json.loads(next(rest for word, rest in done if word == "ENTRYPOINT"))
    script = next(source for source, target in ours if target == entry[0])
    assert os.access(script, os.X_OK)
    built = subprocess.run(
        [sys.executable, "-c", "import deb; print(deb.NAME, deb.version())"],
        cwd=ROOT / "packaging",
        capture_output=True,
        text=True,
        check=True,
    ).stdout.split()
    assert copied[0][0] == f"dist/{built[0]}_*~deb13_${{TARGETARCH}}.deb"
    known = companion.cli.PROGRAM.parser("run").commands["run"]._option_string_actions
    assert all(
        option in known
        for option in re.findall(r"(?<= )--(?:link|http|http-name|keep-gb|from-autopilot)\b", script.read_text())
    )
    assert set(json.loads((FOLDER / "metadata.json").read_text())) == {"name", "website", "docker", "description"}


@pytest.mark.timeout(120)
def test_the_start_script_sails_and_blueos_finds_the_page(tmp_path):
    """All but the container: BlueOS asks every port for /register_service."""
    link, page = free_port(), free_port()
    for path in (ROOT / "missions").glob("lake.*"):
        (tmp_path / path.name.replace("lake.toml", "mission.toml")).write_bytes(path.read_bytes())
    env = {
        **os.environ,
        "PATH": f"{Path(sys.executable).parent}:{os.environ['PATH']}",
        "DATA": str(tmp_path),
        "LINK": f"udpin:127.0.0.1:{link}",
        "PORT": str(page),
        "OPTIONS": "--seed 3 --wait 60",
    }
    boat = subprocess.Popen(
        [
            sys.executable,
            "-m",
            "sitl.cli",
            "boat",
            "--port",
            "0",
            "--udp",
            "0",
            "--udp-out",
            f"127.0.0.1:{link}",
            "--warm",
            "--moored",
            "--home",
            "50.817,-1.31",
        ],
        stdout=subprocess.DEVNULL,
    )
    started = subprocess.Popen([FOLDER / "start-companion"], env=env, stdout=subprocess.DEVNULL)
    try:
        answer = None
        while answer is None:
            assert started.poll() is None
            try:
                with urllib.request.urlopen(f"http://127.0.0.1:{page}/register_service", timeout=5) as reply:
                    answer = json.load(reply)
            except OSError:
                time.sleep(0.2)
        assert {"name", "description", "icon", "company", "version", "webpage", "api"} <= set(answer)
        assert answer["version"] == companion.__version__
        assert list((tmp_path / "voyages").glob("*-lake"))
    finally:
        started.send_signal(signal.SIGINT)
        code = started.wait(60)
        boat.terminate()
        boat.wait(30)
    assert code == 1  # stopped before it arrived
