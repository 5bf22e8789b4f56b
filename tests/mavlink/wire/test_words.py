"""The dialect's own words: what is told of it stays, the rest is given back."""

import re
import subprocess
import sys
from pathlib import Path

import companion
from companion.commands import run
from companion.mavlink import wire
from companion.mavlink.wire.words import NAMED
from companion.planner.fork_server import ForkServer

# In a process of its own: what is given back is gone for all that runs in it.
GIVES_BACK = """
import tracemalloc
tracemalloc.start()
from companion.geofence.mission.autopilot_mission import command_name
from companion.mavlink.vehicle_identity import type_words
from companion.mavlink.wire import give_back_words
before = tracemalloc.get_traced_memory()[0]
give_back_words()
give_back_words()
print(before - tracemalloc.get_traced_memory()[0], command_name(178), type_words(11))
"""


def test_names_are_told_and_the_rest_of_a_megabyte_is_given_back():
    done = subprocess.run([sys.executable, "-c", GIVES_BACK], capture_output=True, text=True, check=True)
    freed, *told = done.stdout.split(maxsplit=2)
    assert int(freed) > 800_000
    assert told == ["DO_CHANGE_SPEED", "surface boat\n"]


def test_what_is_read_of_the_enumerations_is_kept():
    sources = Path(companion.__file__).parent.rglob("*.py")
    assert set(re.findall(r'wire\.enums\["(\w+)"\]', "".join(path.read_text() for path in sources))) == NAMED


def test_a_companion_gives_them_back_before_it_loads_what_takes_the_room(monkeypatch):
    done = []
    monkeypatch.setattr(ForkServer, "begin", lambda _: done.append("forked"))
    monkeypatch.setattr(wire, "give_back_words", lambda: done.append("given back"))
    monkeypatch.setattr(run, "_checked", lambda *_: done.append("checked"))
    run._run(None)
    assert done == ["forked", "given back", "checked"]
