"""Drawn and uploaded by a station that speaks pymavlink: the voyage, its restart, and what becomes of the drawing."""

from __future__ import annotations

import asyncio
import contextlib
import errno
import json
import math
from dataclasses import replace

import pytest

from companion.app.from_autopilot import DrawnSettings, find_on, keep, plan_path
from companion.app.options import SailOptions, at_once
from companion.app.sail import sail
from companion.clock import run_virtual
from companion.disk import Disk
from companion.errors import TransferError, UnreadableError
from companion.geofence import load_mission, read
from companion.geofence.mission import load_settings
from companion.mavlink.autopilot import Autopilot
from companion.mavlink.link import Link
from companion.mavlink.reception import SHORE
from companion.mavlink.wire.codec import mission_item
from companion.messages import GeoPoint, waypoint
from companion.orders import Result, give, phrase
from companion.replay import replay
from companion.skipper.board.mark import are_marked, marked
from sitl.autopilot import HOME, AutopilotConfig, MemoryLink, SimulatedAutopilot, serve
from sitl.faults.computer_faults import FaultyPlanner
from sitl.world.environment import AR1
from tests.sitl.boats import FRAME, Client

BOAT = """
from_autopilot = true
name = "bay"
[area]
margin_m = 10.0
[skipper]
expansions = 2000
[operator]
arm = true
set_auto = true
"""
# East with the wind abeam, with a rock on the straight line.
DRAWING = [(60.0, 0.0), {"en": (150.0, 0.0)}, {"command": 17, "en": (180.0, 30.0)}]
RING = [(-80.0, -120.0), (260.0, -120.0), (260.0, 160.0), (-80.0, 160.0)]
FENCE = [
    *({"command": 5001, "en": en, "p1": 4.0, "frame": 0} for en in RING),
    {"command": 5004, "en": (105.0, 0.0), "p1": 12.0, "frame": 0},
]
RALLY = [{"command": 5100, "en": (10.0, 10.0)}]


class Bay:
    """A boat, a ground station beside it, and a companion that sails what is drawn there."""

    def __init__(self, tmp_path, settings=BOAT):
        self.path = tmp_path / "bay.toml"
        self.path.write_text(settings)
        self.state_path = tmp_path / "voyages" / "bay.state.json"
        self.plan = plan_path(self.state_path)
        self.folder = tmp_path / "voyages" / "first"
        self.boat = SimulatedAutopilot(
            AutopilotConfig(home=HOME, heading_rad=math.pi / 2, is_warm=True, is_moored=True),
            AR1(0.0, 6.0, seed=1, sd_rad=0.05),
            seed=1,
        )
        self.line, self.radio = MemoryLink("companion", seed=1), MemoryLink("station", seed=2)
        self.station = Client(self.radio.near.write, self.boat, system=255, component=190)
        self.crew = MemoryLink("crew", seed=3)
        self.said, self.found, self.steps = [], None, []

    async def on_board(self):
        return [mission_item(m) for m in (await self.station.download())[1:]]

    def run(self, work):
        async def whole():
            await self.radio.near.open(self.station.on_bytes)
            async with serve(self.boat, [self.line.far, self.radio.far, self.crew.far]):
                return await work()

        return run_virtual(whole())

    async def draw(self, mission=DRAWING, fence=FENCE, rally=RALLY):
        for items, kind in ((mission, 0), (fence, 1), (rally, 2)):
            if items is not None:
                assert await self.station.upload(items, kind) == 0

    async def order(self, *words):
        async with Link(self.crew.near, identity=SHORE, streams=(), is_quiet=True) as link:
            await link.wait_autopilot()
            return await give(link, phrase(words))

    async def find(self):
        settings = load_settings(self.path)
        self.found = await find_on(
            self.line.near, settings, self.path, self.state_path, self.plan, self.said.append, wait_s=30.0
        )
        return self.found

    async def sail(self, *, folder=None, on_step=None, **options):
        """What ``companion run`` does with a drawing."""
        found = await self.find()
        assert found.drawn.refusals == ()
        if found.is_new:
            keep(found.document, found.plan, Disk(), is_durable=False)

        def look(_, step):
            self.steps.append(step)
            if on_step is not None:
                on_step(step)

        settings = {
            "epoch_s": 1.78e9,
            "offload": at_once,
            "is_durable": False,
            "limit_s": 500.0,
            "expansions": 2000,
            "state_path": self.state_path,
            "known": (found.board,),
            "is_again": found.is_new,
            "exit_on_arrival": True,
            "settings": DrawnSettings(options=load_settings(self.path), path=self.path, state_path=self.state_path),
        }
        return await sail(
            found.drawn.mission,
            self.line.near,
            FaultyPlanner(),
            folder or self.folder,
            SailOptions(**settings | options),
            on_status=look,
        )

    def announced(self, folder=None):
        lines = ((folder or self.folder) / "decisions.jsonl").read_text().splitlines()
        return [d["text"] for d in map(json.loads, lines) if d.get("action") == "Announce"]


def test_a_drawing_is_sailed_by_planning_between_its_points(tmp_path):
    bay = Bay(tmp_path)
    track = []

    async def work():
        await bay.draw()
        summary = await bay.sail(on_step=lambda s: track.append(FRAME.en_from_geo(bay.boat.truth.position)))
        return summary, await bay.on_board()

    summary, on_board = bay.run(work)
    assert summary["arrived"]
    assert (summary["goals"], summary["goals_reached"]) == (3, 3)
    assert bay.found.is_new
    assert bay.found.drawn.notes == ()
    assert min(math.dist(en, (105.0, 0.0)) for en in track) > 12.0 + 6.0, "round the rock that was drawn"
    assert are_marked(on_board), "our plan took the drawing's place"
    # kept where it can be opened again, and in the voyage's own folder
    kept = read(bay.plan)
    assert [i.command for i in kept.items] == [16, 16, 17]
    assert (len(kept.zones), len(kept.rally)) == (2, 1)
    copy = load_mission(bay.folder / "mission" / "mission.toml")
    assert [g.name for g in copy.goals] == ["item 1", "item 2", "item 3"]
    assert [r.name for r in copy.refuges] == ["rally 1"]
    assert len(copy.area.obstacles) == 1
    assert replay(bay.folder).differences == ()
    assert any("or the drawing that is sailed: it is replaced" in text for text in bay.announced())


def test_a_loiter_for_a_time_is_stayed_in_on_the_way(tmp_path):
    bay = Bay(tmp_path)
    place, near_s = (180.0, 0.0), []

    def look(step):
        here = FRAME.en_from_geo(bay.boat.truth.position)
        if max(abs(here[0] - place[0]), abs(here[1] - place[1])) <= 25.0:
            near_s.append(step.snapshot.t_s)

    async def work():
        await bay.draw([(60.0, 0.0), {"command": 19, "en": place, "p1": 90.0}, (60.0, 60.0)])
        return await bay.sail(on_step=look)

    summary = bay.run(work)
    assert (summary["arrived"], summary["goals_reached"]) == (True, 3)
    assert 90.0 <= len(near_s) <= 160.0, "a step a second"
    assert replay(bay.folder).differences == ()


def test_killed_under_way_she_sails_on_by_the_drawing_that_was_kept(tmp_path):
    bay = Bay(tmp_path)

    async def work():
        await bay.draw()
        reached = asyncio.Event()
        life = asyncio.create_task(bay.sail(on_step=lambda s: s.state.progress.reached and reached.set()))
        await reached.wait()
        life.cancel()
        with contextlib.suppress(asyncio.CancelledError):
            await life
        before = bay.found
        assert are_marked(await bay.on_board())
        summary = await bay.sail(folder=tmp_path / "voyages" / "second")
        return before, summary

    before, summary = bay.run(work)
    assert before.is_new
    assert not bay.found.is_new
    assert bay.found.drawn.mission.goals == before.drawn.mission.goals
    assert bay.found.drawn.mission.name == before.drawn.mission.name
    assert (summary["arrived"], summary["goals"]) == (True, 3)
    assert summary["goals_reached"] == 3  # the one before the kill is told, too, ...
    again = [text.split(",")[0] for text in bay.announced(tmp_path / "voyages" / "second") if text.startswith("item ")]
    assert [text for text in again if "reached" in text] == ["item 2 reached", "item 3 reached"]  # ... not sailed again
    assert replay(tmp_path / "voyages" / "second").differences == ()


def test_sailing_by_the_drawing_already_she_goes_on_until_there_is_a_plan(tmp_path):
    """The crew drew, set AUTO and armed; the companion comes later. The laps of the drawing are no places."""
    bay = Bay(tmp_path)
    laps = [(60.0, 0.0), (60.0, 60.0), {"command": 177, "p1": 1.0, "p2": 1.0, "frame": 2}]

    async def work():
        await bay.draw(fence=FENCE, rally=None)
        await bay.station.set_sail(laps)
        return await bay.sail()

    summary = bay.run(work)
    assert (summary["arrived"], summary["goals"]) == (True, 4)
    assert any("sailing on by it until there is a plan" in text for text in bay.announced())
    assert all(s.snapshot.autopilot is None or s.snapshot.autopilot.is_armed for s in bay.steps[5:])


def test_a_new_drawing_under_way_is_offered_and_she_stands_by(tmp_path):
    bay = Bay(tmp_path)
    other = [(40.0, 40.0), (60.0, 40.0), (80.0, 40.0), (60.0, 60.0), {"command": 20, "frame": 2}]

    async def work():
        await bay.draw()
        life = asyncio.create_task(bay.sail(limit_s=200.0))
        await asyncio.sleep(70.0)
        assert await bay.station.upload(other) == 0
        await life
        kept = await bay.on_board()
        # the next start with --from-autopilot sails it: that is what the crew asked for then
        return kept, await bay.find()

    on_board, found = bay.run(work)
    assert [i.command for i in on_board] == [16, 16, 16, 16, 20], "nobody has overwritten it"
    assert "a mission of 5 items was drawn: adopt it by the order adopt" in bay.announced()
    assert sum(text.startswith("a mission of 5") for text in bay.announced()) == 1
    assert (found.is_new, len(found.drawn.mission.goals), found.drawn.mission.skipper.end) == (True, 4, "home")


@pytest.mark.parametrize("can_be_sailed", [True, False])
def test_a_drawing_adopted_under_way_ends_the_voyage_for_its_own(tmp_path, can_be_sailed):
    """By the crew's order; one that cannot be sailed ends nothing."""
    bay = Bay(tmp_path, BOAT + 'orders = ["adopt"]\n')
    other = [(40.0, 40.0), (70.0, 40.0) if can_be_sailed else (105.0, 0.0)]
    answers = []

    async def work():
        await bay.draw()
        life = asyncio.create_task(bay.sail(limit_s=200.0))
        await asyncio.sleep(70.0)
        answers.append(await bay.order("adopt"))
        assert await bay.station.upload(other) == 0
        await asyncio.sleep(10.0)
        answers.append(await bay.order("adopt"))
        first = await life
        return first, await bay.sail(folder=tmp_path / "voyages" / "second") if can_be_sailed else None

    first, second = bay.run(work)
    assert answers[0].text == "nothing drawn is on offer"
    assert answers[1].result is Result.DONE
    if not can_be_sailed:
        assert first["end_reason"] == "out of time"
        assert any(t.startswith("the drawing is not adopted: item 2: ") for t in bay.station.texts())
        return
    assert (first["arrived"], first["end_reason"]) == (False, "adopted")
    assert (second["arrived"], second["goals"], second["goals_reached"]) == (True, 2, 2)
    assert second["mission"] != first["mission"]
    assert [i.command for i in read(bay.plan).items] == [16, 16], "the new one is kept"


def test_an_upload_of_ours_that_was_cut_short_over_the_drawing_is_known(tmp_path):
    bay = Bay(tmp_path)

    async def work():
        await bay.draw()
        keep((await bay.find()).document, bay.plan, Disk())
        drawn = await bay.on_board()
        async with Link(bay.line.near) as link, Autopilot(link) as autopilot:
            half = [*marked([replace(drawn[0], lat_e7=drawn[0].lat_e7 + 500)]), *drawn[1:]]
            assert (await autopilot.upload_mission(half)).is_ok
        return await bay.find()

    found = bay.run(work)
    assert not found.is_new
    assert [g.name for g in found.drawn.mission.goals] == ["item 1", "item 2", "item 3"]


# ------------------------------------------------------------------------------------------- nothing to sail
@pytest.mark.parametrize(
    ("mission", "fence", "words"),
    [
        ([], None, "there is no mission on the autopilot"),
        ([], FENCE, "there is no mission on the autopilot, only a fence"),
        (
            [(60.0, 0.0), {"command": 178, "frame": 2}],
            None,
            "item 2: error: DO_CHANGE_SPEED is nothing that a voyage does",
        ),
        ([(60.0, 0.0), (105.0, 2.0)], FENCE, "item 2: error: 51.100018, -1.298501 is inside the obstacle 'obstacle 1'"),
        (
            [(60.0, 0.0), {"command": 177, "p1": 1.0, "p2": -1.0, "frame": 2}],
            None,
            "item 2: error: DO_JUMP repeats without end",
        ),
    ],
)
def test_a_drawing_that_cannot_be_sailed_is_refused_here_and_on_the_radio(tmp_path, mission, fence, words):
    bay = Bay(tmp_path)

    async def work():
        await bay.draw(mission, fence, None)
        before = await bay.on_board()
        await bay.find()
        await asyncio.sleep(1.0)
        return before, await bay.on_board()

    before, after = bay.run(work)
    assert bay.found.drawn.mission is None
    lines = [f.line(bay.found.document.source) for f in bay.found.drawn.refusals]
    assert any(words in line for line in lines), lines
    assert before == after
    assert not bay.boat.truth.is_armed
    assert any(text.startswith("the drawing is refused") for text in bay.station.texts())


def test_a_list_of_ours_without_its_drawing_is_not_taken_for_one(tmp_path):
    bay = Bay(tmp_path)

    async def work():
        async with Link(bay.line.near) as link, Autopilot(link) as autopilot:
            items = marked(
                [
                    waypoint(GeoPoint(lat_deg=51.101, lon_deg=-1.3)),
                    waypoint(GeoPoint(lat_deg=51.101, lon_deg=-1.3), command=17),
                ]
            )
            assert (await autopilot.upload_mission(items)).is_ok
        await bay.find()

    with pytest.raises(UnreadableError, match=r"one of ours, and no drawing is kept at .*drawn\.plan; draw"):
        bay.run(work)


def test_a_transfer_that_times_out_is_said_and_tried_again(tmp_path):
    bay = Bay(tmp_path)

    async def work():
        await bay.draw()
        finding = asyncio.create_task(bay.find())
        await asyncio.sleep(6.0)
        bay.line.cut()
        await asyncio.sleep(30.0)
        bay.line.mend()
        return await finding

    found = bay.run(work)
    assert len(found.drawn.mission.goals) == 3
    assert any("could not be read from the autopilot" in text and "trying again" in text for text in bay.said)

    never = Bay(tmp_path)

    async def dead():
        await never.draw()
        finding = asyncio.create_task(never.find())
        await asyncio.sleep(6.0)
        never.line.cut()
        await finding

    with pytest.raises(TransferError, match=r"could not be read from the autopilot, 5 times: .*; nothing was sent"):
        never.run(dead)


def test_a_drawing_that_is_still_being_uploaded_is_read_again(tmp_path):
    bay = Bay(tmp_path)

    async def work():
        await bay.draw(fence=None, rally=None)
        finding = asyncio.create_task(bay.find())
        await asyncio.sleep(5.0)
        assert bay.said == []
        await bay.draw(mission=None)
        return await finding

    found = bay.run(work)
    assert any("is changing: it is read again" in text for text in bay.said)
    assert len(found.drawn.mission.area.fence.zones) == 1
    assert len(found.drawn.mission.refuges) == 1


def test_a_drawing_that_cannot_be_kept_is_not_sailed(tmp_path):
    bay = Bay(tmp_path)

    class Full(Disk):
        def write(self, fd, data):
            raise OSError(errno.ENOSPC, "No space left on device")

    async def work():
        await bay.draw()
        found = await bay.find()
        with pytest.raises(UnreadableError, match=r"the drawing cannot be kept: No space left .*make room"):
            keep(found.document, found.plan, Full())

    bay.run(work)
    assert not bay.plan.exists()
