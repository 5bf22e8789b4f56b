"""What README and the pages tell a reader to type: README's lines and benches are run, in an empty folder, in order.

So are lines of other pages that need neither a boat nor long. Every other is understood by its program, and not run.
"""

import argparse
import contextlib
import math
import os
import re
import shlex
import shutil
import signal
import subprocess
import sys
import urllib.request
from pathlib import Path

import pytest

import companion.commands.mission
from companion import cli
from companion.errors import InputError
from sitl import cli as sitl_cli
from sitl.scenario.traffic import free_port

ROOT = Path(__file__).parents[2]
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").rglob("*.md"))]
PROGRAMS = {"companion": cli.PROGRAM, "sitl": sitl_cli.PROGRAM}
# What stands for something of the reader's own, and a word of its kind.
STANDS_FOR = {"LINK": "tcp:127.0.0.1:5760", "LAT,LON": "50.817,-1.31", "VERB": "hold", "ADDRESS": "local", "[ARGS]": ""}
WORDS = {"N": "3", "S": "3", "NAME": "demo", "SCENARIO": "demo", "PICTURE": "p.png"}
# Of README, what a test is no place for.
NOT_RUN = {
    "make demo": "CI runs it",
    "make test": "this is it",
    "python3 -m venv": "CI makes one",
    "pip install": "CI installs it",
}
# What a page says that is run as it stands, in one folder, and what lies there for the reader's own files.
CHEAP = re.compile(
    r"(companion (--version|mission (example|check|convert) |boat trial |fence (check|convert) |plan |field "
    r"|key new |far (order|begin) |order --qgc |report |view .* --export |wind RECORD)|sitl example )"
)
OWN = {
    "MISSION.toml": "missions/field-ring.toml",
    "FILE": "missions/bay.toml",
    "P.png": "p.png",
    "OUT": "out.plan",
    "PROBLEM.json": "island.json",
    "sailbench/problems/channels-noisy.json": "island.json",
    "MISSION": "missions/bay.toml",
    "sitl/missions/tide-gate.toml": str(ROOT / "sitl" / "missions" / "tide-gate.toml"),
    "RECORD.csv": "record.csv",
    "RECORD": "record.csv",
    "RECORDS": "record.csv",
    "missions": "more",
    "voyages/20260714T101500Z-archipelago": "voyages/one",
}
NAMES_A_COMMAND = re.compile("are required|expected one argument")  # and not a line to type
UNDER_WAY, ENDS_S = "under way", 60.0


def blocks(page):
    """Return the lines of a page's indented blocks that begin with a program, without what a # says of them."""
    first = "companion|sitl|make|python3?|pip"
    lines = re.findall(rf"^ {{4,}}((?:{first}) (?:[^\n]*\\\n)*[^\n]*)", page.read_text(), re.MULTILINE)
    return [re.sub(r"\s+#.*", "", line.replace("\\\n", " ")).strip() for line in lines if "run: " not in line]


def quoted(page):
    """Return the command lines between backticks that are whole: more than the name of a command."""
    return [
        line
        for line in re.findall(r"`((?:companion|sitl) [a-z][^`]* [^`]+)`", page.read_text().replace("\n", " "))
        if "..." not in line
    ]


def words_of(line):
    for name, word in STANDS_FOR.items():
        line = line.replace(name, word)
    line = re.sub(r"sitl (run|campaign) FILE", r"sitl \1 demo", line)
    return [WORDS.get(word, word) for word in shlex.split(line) if word not in ("&", "&&")]


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_every_command_line_of_a_page_is_understood(page, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    typed_ones = [line for line in blocks(page) if line.startswith(("companion ", "sitl "))]
    for line in (*typed_ones, *quoted(page)):
        program, *words = words_of(line)
        if words[-1] in ("--help", "--version"):
            continue
        try:
            PROGRAMS[program].parser(words[0]).parse_args(words)
        except InputError as wrong:
            if line in typed_ones or not NAMES_A_COMMAND.search(str(wrong)):
                pytest.fail(f"{line}: {wrong}")


@pytest.mark.parametrize(
    "name", [(program, command) for program, it in PROGRAMS.items() for command in it.names], ids=" ".join
)
def test_the_examples_of_a_help_are_understood_and_name_what_an_installed_program_has(name, monkeypatch, tmp_path):
    program, command = name
    monkeypatch.chdir(tmp_path)
    companion.commands.mission._example(argparse.Namespace(folder=Path("missions")))
    monkeypatch.setenv("COLUMNS", "1000")
    text = helps(PROGRAMS[program].parser(command))
    assert "sitl/scenarios" not in text
    assert [file for file in re.findall(r"missions/[\w.-]+", text) if not Path(file).exists()] == []
    assert not re.search(r"(?<!/)\barchipelago\.toml", text)  # where it is written, and not where the reader stands
    for line in re.findall(r"^  ((?:companion|sitl) [a-z].*?)(?:\s{2,}.*)?$", text, re.MULTILINE):
        try:
            words = words_of(line)[1:]
            PROGRAMS[line.partition(" ")[0]].parser(words[0]).parse_args(words)
        except InputError as wrong:
            pytest.fail(f"{line}: {wrong}")


def helps(parser):
    """Return the help of a parser and of all below it."""
    below = [
        p
        for action in parser._actions
        if isinstance(action, argparse._SubParsersAction)
        for p in action.choices.values()
    ]
    return "\n".join([parser.format_help(), *(helps(p) for p in below)])


@contextlib.contextmanager
def typed(line, folder):
    """Type a line into a shell in the folder; it is stopped with Ctrl-C in the end, where it has not ended."""
    env = {
        **os.environ,
        "PATH": f"{Path(sys.executable).parent}:{os.environ['PATH']}",
        "PYTHONPATH": str(ROOT),
        "LANG": "C",
    }
    shell = subprocess.Popen(
        ["bash", "-c", f"exec {line}"],
        cwd=folder,
        env=env,
        stdin=subprocess.DEVNULL,
        text=True,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        start_new_session=True,
    )
    said = ""
    try:
        yield shell
    finally:
        if shell.poll() is None:
            os.killpg(shell.pid, signal.SIGINT)  # as a terminal does: to all of the group
            with contextlib.suppress(subprocess.TimeoutExpired):
                said = shell.communicate(timeout=ENDS_S)[0]
        shell.kill()
    assert "Traceback" not in said


def until(shell, said):
    """Read what it says until the pattern is found; fail with all of it where it ends before."""
    seen = ""
    for text in shell.stdout:
        seen += text
        if re.search(said, text):
            return seen
    pytest.fail(f"ended, {shell.wait()}, and never said {said}: {seen[-2000:]}")
    return seen


def door(heading):
    """Return the command lines under a heading of README."""
    part = (ROOT / "README.md").read_text().partition(f"## {heading}\n")[2].partition("\n## ")[0]
    lines = re.findall(r"^ {4}(\S.*)$", part, re.MULTILINE)
    assert lines, heading
    return [re.sub(r"\s+#.*", "", line) for line in lines]


def done(line, folder):
    with typed(line, folder) as shell:
        said, _ = shell.communicate(timeout=200)
    assert shell.returncode == 0, f"{line}: {said[-2000:]}"
    return said


def page_is_served(line, folder, said):
    port = free_port()
    with typed(line.replace("8765", str(port)), folder) as shell:
        until(shell, said)
        with urllib.request.urlopen(f"http://127.0.0.1:{port}/", timeout=20) as answer:
            assert answer.status == 200


def test_each_line_of_the_front_page_is_run_here_or_it_is_said_why_not():
    doors = {
        line
        for heading in (
            "I want to see it sail",
            "I want to draw a mission",
            "I want it on my boat",
            "I want to do research",
        )
        for line in door(heading)
    }
    others = set(blocks(PAGES[0])) - doors
    assert [line for line in others if not line.startswith(tuple(NOT_RUN))] == []
    assert len(doors) == 12


def test_who_wants_to_see_it_sail(tmp_path):
    demo, live, report = door("I want to see it sail")
    assert "arrived" in done(demo, tmp_path)
    page_is_served(live, tmp_path, UNDER_WAY)
    assert "Arrived after" in done(report, tmp_path)
    assert list(tmp_path.glob("voyages/*/voyage.png"))


def test_who_wants_to_draw_a_mission(tmp_path):
    example, edit, live = door("I want to draw a mission")
    assert "archipelago.toml" in done(example, tmp_path)
    port = free_port()
    with typed(f"{edit} --http {port}", tmp_path) as shell:
        until(shell, rf"http://127.0.0.1:{port}/#")
    page_is_served(live, tmp_path, UNDER_WAY)


def test_a_mission_of_ones_own_that_permits_nothing_sails_in_the_simulator(tmp_path):
    done("companion mission new own.toml --start 50.8170,-1.3100 --goal 50.8220,-1.3094", tmp_path)
    with typed("sitl run own.toml --live --speedup 20", tmp_path) as shell:
        said = until(shell, UNDER_WAY)
    assert "[operator] of the mission forbids it" in said


def test_who_wants_it_on_his_boat(tmp_path):
    setup, doctor, run = door("I want it on my boat")
    port = free_port()
    with typed(f"sitl boat --port {port} --udp 0 --home 50.8170,-1.3100", tmp_path) as boat:
        until(boat, "Ctrl-C ends")
        here = f"tcp:127.0.0.1:{port}"
        setup, doctor, run = (line.replace("tcp:127.0.0.1:5760", here) for line in (setup, doctor, run))
        assert "0 errors, 0 warnings; nothing was changed" in done(setup, tmp_path)
        assert "0 errors, 0 warnings; nothing was changed" in done(doctor, tmp_path)
        with typed(run, tmp_path) as shell:
            until(shell, r"WAITING \| mean wind")


def test_the_bench_of_an_evening_from_an_empty_folder(tmp_path):
    """A boat in one terminal, the companion in another: moored until it sails, however long that takes."""
    boat_line, example, run = [
        line
        for line in blocks(ROOT / "docs" / "guides" / "boat-in-an-evening.md")
        if line.startswith(("sitl boat", "companion mission example", "companion run"))
    ]
    port = free_port()
    with typed(f"{boat_line} --port {port} --udp 0", tmp_path) as boat:
        until(boat, "Ctrl-C ends")
        done(example, tmp_path)
        with typed(run.replace(":5760", f":{port}"), tmp_path) as shell:
            until(shell, UNDER_WAY)


def cheap_lines():
    """Return the lines of the pages that are whole and run as they stand, none twice, as their words."""
    lines = dict.fromkeys(line for page in PAGES[2:] for line in (*blocks(page), *quoted(page)) if CHEAP.match(line))
    for line in lines:
        program, *words = words_of(line)
        with contextlib.suppress(InputError):
            if words != ["--version"]:
                PROGRAMS[program].parser(words[0]).parse_args(words)
            yield program, *(f"by-{program}" if word == "DIR" else OWN.get(word, word) for word in words)


def test_what_pages_say_that_is_cheap_is_run(tmp_path):
    """In one folder, in the pages' order, beside missions, a problem, a wind record and a voyage of the reader's."""
    done("companion mission example missions", tmp_path)
    done("sitl run rocks", tmp_path)
    next((tmp_path / "voyages").iterdir()).rename(tmp_path / "voyages" / "one")
    (tmp_path / "record.csv").write_text(
        "t_s,wind_from_deg,wind_speed_ms\n"
        + "".join(f"{t},{200 + 10 * math.sin(t / 90):.1f},{6 + math.sin(t / 37):.2f}\n" for t in range(0, 2400, 2))
    )
    shutil.copy(ROOT / "sailbench" / "problems" / "channels-noisy.json", tmp_path / "island.json")
    lines = [" ".join(word if "*" in word else shlex.quote(word) for word in words) for words in cheap_lines()]
    assert len(lines) > 15
    for line in lines:
        assert "Traceback" not in done(line, tmp_path), line


def test_a_guide_that_rehearses_does(tmp_path):
    for line in blocks(ROOT / "docs" / "guides" / "rehearse.md")[:2]:
        done(line + (" --runs 1 --pairs 0 --workers 1" if "rehearse" in line else ""), tmp_path)
    assert (tmp_path / "rehearsals" / "archipelago" / "rehearsal.html").is_file()


def test_who_wants_to_do_research(tmp_path):
    campaign, plan, mismatch = door("I want to do research")
    done("companion mission example missions", tmp_path)
    assert "1/1 sailed, 0 failed" in done(campaign.replace("--runs 10", "--runs 1"), tmp_path)
    assert "plan.png" in done(plan, tmp_path)
    assert done(mismatch.replace("--runs 10", "--runs 1"), tmp_path)
