"""The state for a restart: whatever lies in its place is read or refused in one line, and no disk can stop a voyage."""

import asyncio
import json
import time
from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from companion.app.options import at_once, in_thread
from companion.clock import run, run_virtual
from companion.disk import Disk
from companion.messages import MissionItem, Mode
from companion.skipper.board.mark import marked
from companion.skipper.step.route import Route
from companion.skipper.step.saved import Persisted
from companion.telemetry import state_file
from companion.telemetry.state_file import StateFile
from sitl.faults.computer_faults import FaultyDisk

ITEMS = (MissionItem(command=16, lat_e7=508170000, lon_e7=-13100000), MissionItem(command=17, lat_e7=5, lon_e7=7))
ROUTE = Route(
    items=marked(ITEMS),
    points_en_m=((0.0, 1.0), (2.0, 3.0)),
    leg_from_en_m=((0.0, 0.0), (0.0, 1.0)),
    gate_of=(0, -1),
    plan_id=3,
    plan_t_s=12.5,
    plan_twd_from_rad=0.1,
    plan_tws_mps=5.0,
    plan_half_width_rad=0.2,
    margin_m=12.0,
    delta_s=0.9,
    cost_s=60.0,
    why="because",
)
SAVED = Persisted(voyage="a", gate=1, sailing=True, route=ROUTE, pending=None, unsure=ROUTE, own_mode=Mode.LOITER)


def file(path, disk=None, offload=at_once):
    return StateFile(path, disk=disk or Disk(), offload=offload)


def test_what_is_saved_is_read(tmp_path):
    run_virtual(file(tmp_path / "x" / "state.json").save(SAVED))
    again = file(tmp_path / "x" / "state.json")
    assert again.load() == SAVED
    assert again.refusal == ""


DAMAGE = {
    "empty": b"",
    "torn": json.dumps(SAVED.to_dict()).encode()[:-40],
    "deep": b"[" * 100_000,
    "deep and closed": b'{"format":1,"voyage":' + b"[" * 5000 + b"]" * 5000 + b"}",
    "1e999": json.dumps(SAVED.to_dict()).replace('"gate": 1', '"gate": 1e999').encode(),
    "1e999 in a place": json.dumps(SAVED.to_dict()).replace("508170000", "1e999").encode(),
    "1e999 in a figure": json.dumps(SAVED.to_dict()).replace("12.5", "1e999").encode(),
    "not a number": json.dumps(SAVED.to_dict()).replace("12.5", "NaN").encode(),
    "digits": b'{"format":' + b"9" * 10_000 + b"}",
    "not UTF-8": b"\xff\xfe\x00{",
    "zeros": bytes(4096),
    "a list": b"[]",
    "null": b"null",
    "another format": b'{"format":99}',
    "a negative gate": json.dumps({**SAVED.to_dict(), "gate": -1}).encode(),
    "words for a truth": json.dumps({**SAVED.to_dict(), "sailing": "no"}).encode(),
    "too long": b" " * (state_file.MAX_BYTES + 1),
}


@pytest.mark.parametrize("name", DAMAGE)
def test_a_damaged_state_is_refused_in_one_line_and_kept_aside(name, tmp_path):
    """RecursionError and OverflowError ended the restart."""
    path = tmp_path / "a.state.json"
    path.write_bytes(DAMAGE[name])
    state = file(path)
    assert state.load() is None
    assert state.refusal.startswith("a.state.json is not used: ")
    assert state.refusal.endswith("it is kept as a.state.json.damaged")
    assert "\n" not in state.refusal
    assert len(state.refusal) < 250
    assert not path.exists()
    assert (tmp_path / "a.state.json.damaged").read_bytes() == DAMAGE[name]


JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats(allow_nan=True) | st.text(max_size=6),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=6), inner, max_size=4),
    max_leaves=6,
)


@settings(max_examples=120)
@given(st.data())
def test_a_state_with_anything_anywhere_is_read_or_refused(data):
    values = SAVED.to_dict()
    holder, key = data.draw(st.sampled_from(list(places(values))))
    holder[key] = data.draw(JSON)
    try:
        read = Persisted.from_dict(json.loads(json.dumps(values)))
    except ValueError:
        return
    assert Persisted.from_dict(json.loads(json.dumps(read.to_dict(), allow_nan=False))) == read


def places(value):
    keys = value.keys() if isinstance(value, dict) else range(len(value))
    for key in keys:
        yield value, key
        if isinstance(value[key], (dict, list)):
            yield from places(value[key])


@pytest.mark.parametrize(
    "wrong",
    [
        {"searched": [[1e12, 0.0]]},
        {"approaches": [[0, 0.0, -1e12, None]]},
        {"place": [1.9e9, 1e12, 0.0, 0.0, 0.0, 0.0, 0.0]},
        {"place": [1.9e9, 0.0, 0.0, 1e12, 0.0, 0.0, 0.0]},
        {"shoals": [[1e12, 0.0, 30.0, 5.0, 1.0]]},
        {"standing": {"verb": "goal", "by": "x", "name": "", "before_s": 0.0, "en_m": [1e12, 0.0]}},
        {"water": [91.0, 0.0]},
        {"goals": [[0.0, 181.0, ""]]},
        {"route": {**SAVED.to_dict()["route"], "points": [[1e12, 0.0], [0.0, 0.0]]}},
        {"route": {**SAVED.to_dict()["route"], "from": [[1e12, 0.0], [0.0, 0.0]]}},
    ],
    ids=str,
)
def test_a_place_that_is_not_on_earth_is_not_believed(wrong):
    """A grid about it took all memory at the first tick, of each start."""
    with pytest.raises(ValueError, match="where a place should be"):
        Persisted.from_dict({**SAVED.to_dict(), **wrong})


def test_a_state_that_cannot_be_read_is_left_where_it_is(tmp_path):
    (tmp_path / "state.json").mkdir()
    state = file(tmp_path / "state.json")
    assert state.load() is None
    assert "cannot be read" in state.refusal
    assert (tmp_path / "state.json").is_dir()


def test_a_state_that_could_not_be_saved_is_saved_when_it_can(tmp_path):
    disk = FaultyDisk()
    state = file(tmp_path / "state.json", disk)

    async def voyage():
        disk.become("full")
        await state.save(SAVED)
        assert state.trouble == "No space left on device"
        disk.become("ok")
        await state.save(SAVED)
        assert not (tmp_path / "state.json").exists()  # not at every step: a sick card answers slowly
        await asyncio.sleep(state_file.TRY_EVERY_S)
        await state.save(SAVED)
        assert state.trouble == ""

    run_virtual(voyage())
    assert file(tmp_path / "state.json").load() == SAVED


class Hung(Disk):
    """A card that does not answer for a while."""

    asked = 0

    def sync(self, fd):
        self.asked += 1
        if self.asked == 1:
            time.sleep(0.5)
        super().sync(fd)


def test_a_card_that_does_not_answer_is_not_waited_for(tmp_path, monkeypatch):
    monkeypatch.setattr(state_file, "PATIENCE_S", 0.1)
    monkeypatch.setattr(state_file, "TRY_EVERY_S", 0.0)
    card = Hung()
    state, newer = file(tmp_path / "state.json", card, in_thread), replace(SAVED, under_way_s=SAVED.under_way_s + 60.0)

    async def voyage():
        began = time.monotonic()
        await state.save(SAVED)
        await state.save(newer)  # nor is it asked while it has the last one: that may come behind this
        assert time.monotonic() - began < 0.4
        assert state.trouble == "the disk does not answer"
        assert card.asked == 1
        while state.trouble:
            await asyncio.sleep(0.05)
            await state.save(newer)

    run(voyage())
    assert file(tmp_path / "state.json").load() == newer


def test_the_lists_of_other_missions_in_the_folder_are_known(tmp_path):
    run_virtual(file(tmp_path / "a.state.json").save(SAVED))
    (tmp_path / "broken.state.json").write_bytes(b"[" * 100_000)
    (tmp_path / "note.json").write_text("{}")
    assert file(tmp_path / "b.state.json").known() == (SAVED.names[0],)
    assert file(tmp_path / "a.state.json").known() == ()
    assert (tmp_path / "broken.state.json").exists()  # another mission's: not ours to put aside
