"""What is kept in step with the autopilot while a voyage lasts."""

import asyncio
from types import SimpleNamespace

import pytest

from companion.app.autopilot_upkeep import FENCE_EVERY_S, FENCE_READ_S, keep_fence, keep_parameters
from companion.app.options import at_once
from companion.clock import now_s, run_virtual
from companion.fold import ParameterStore
from companion.geo.frame import LocalFrame
from companion.geofence import Area, Circle, Obstacle
from companion.mavlink.wire import RANGES
from companion.messages import GeoPoint, MissionItem, Severity


def test_a_parameter_that_seems_to_have_been_set_is_asked_for_again_whether_a_voyage_reads_it_or_not():
    parameters, asked = ParameterStore(), []
    parameters.take(dict.fromkeys(RANGES, 1.0))
    parameters.take({"AHRS_ORIENTATION": 8.0}, is_set=True)

    async def get_parameter(name):
        asked.append(name)
        if name == "AHRS_ORIENTATION":
            _, _, changes = parameters.take({name: 8.0})
            assert [c.after for c in changes] == [8.0]

    link = SimpleNamespace(is_alive=True, stats=SimpleNamespace(reboots=0))
    autopilot = SimpleNamespace(link=link, get_parameter=get_parameter)

    async def keep():
        task = asyncio.create_task(keep_parameters(parameters, autopilot))
        await asyncio.sleep(20.0)
        task.cancel()

    run_virtual(keep())
    assert asked.count("AHRS_ORIENTATION") == 1
    assert set(asked) == {*RANGES, "AHRS_ORIENTATION"}


def test_what_is_drawn_on_the_autopilot_is_read_while_a_fence_is_in_force_and_no_plan_waits_for_it():
    """Its content was never looked at: a fence that a person drew under way was not known of."""
    one, other = (MissionItem(command=5003, params=(100.0, 0, 0, 0)),), (MissionItem(command=5003),)
    shown = SimpleNamespace(fence_breached=None, fence_breaches=None)
    state = SimpleNamespace(vehicle=SimpleNamespace(is_ours=True), pending=SimpleNamespace(upload=None))
    fold = SimpleNamespace(state=state, permissions=SimpleNamespace(may_upload_fence=False))
    read_s, ended, taken, answers = [], [], [], []

    async def read_fence():
        read_s.append(now_s())
        try:
            await asyncio.sleep(0.0 if answers else 1e6)  # a link that answers nothing
        except asyncio.CancelledError:
            ended.append(now_s())
            raise
        return SimpleNamespace(items=answers[-1])

    autopilot = SimpleNamespace(link=SimpleNamespace(is_alive=True), status=shown, read_fence=read_fence)

    async def lived():
        task = asyncio.create_task(keep_fence(fold, autopilot, None, None, taken.append, at_once))
        await asyncio.sleep(30.0)
        assert read_s == []  # there is none in force
        shown.fence_breached = False
        await asyncio.sleep(FENCE_READ_S + 2.0)
        assert len(read_s) == 1
        answers.append(one)
        await asyncio.sleep(3.0 * FENCE_EVERY_S)
        assert (len(taken), taken[-1]) == (1, one)  # told once
        answers.append(other)
        shown.fence_breached, before = True, len(read_s)
        await asyncio.sleep(2.0)
        assert len(read_s) == before + 1  # at once, when anything new is said of it
        assert taken == [one, other]
        answers.clear()
        shown.fence_breaches = 1
        await asyncio.sleep(1.5)  # it is being read, to no end ...
        assert len(ended) == 1
        state.pending.upload = object()  # ... and gives way
        await asyncio.sleep(0.2)
        assert len(ended) == 2
        before = len(read_s)
        await asyncio.sleep(60.0)
        assert len(read_s) == before
        task.cancel()

    run_virtual(lived())


@pytest.mark.parametrize("apart_m", [40.0, 400.0])
def test_what_the_autopilots_fence_has_no_room_for_is_said_and_recorded(apart_m):
    """A chart has more rocks than 84: the nearest go up, and nobody is left to believe that all of them did."""
    start = GeoPoint(lat_deg=50.8, lon_deg=-1.3)
    frame = LocalFrame(start)
    rocks = tuple(
        Obstacle(shape=Circle(frame.geo_from_en(100.0 + apart_m * (n % 10), apart_m * (n // 10)), 5.0))
        for n in range(70)
    )
    area = Area(obstacles=rocks[:20] if apart_m == 40.0 else rocks)
    mission = SimpleNamespace(start=start, places=(frame.geo_from_en(0.0, 300.0),), area=area, margin_m=5.0)
    state = SimpleNamespace(vehicle=SimpleNamespace(is_ours=True), orders=SimpleNamespace(standing=None))
    fold = SimpleNamespace(state=state, permissions=SimpleNamespace(may_upload_fence=True))
    said, uploaded, records = [], [], []
    done = SimpleNamespace(is_ok=True, outcome=SimpleNamespace(value="accepted"), text="")

    async def upload_fence(items):
        uploaded.append(items)
        return done

    async def enable_fence():
        return done

    autopilot = SimpleNamespace(
        link=SimpleNamespace(is_alive=False),
        status=None,
        upload_fence=upload_fence,
        enable_fence=enable_fence,
        say=lambda *words: said.append(words),
    )

    async def lived():
        task = asyncio.create_task(keep_fence(fold, autopilot, mission, records.append, None, offload))
        await asyncio.sleep(5.0)
        task.cancel()

    offloaded = []

    async def offload(work):
        offloaded.append(len(uploaded))
        work()

    run_virtual(lived())
    assert offloaded == [0], "the steps do not wait for it"
    assert records[0]["count"] == len(uploaded[0]) > 10
    if apart_m == 40.0:
        assert (said, "reach_m" in records[0]) == ([], False)
    else:
        assert len(uploaded[0]) < len(rocks)
        (severity, text), reach_m = said[0], records[0]["reach_m"]
        assert severity == Severity.WARNING
        assert f"only what lies within {reach_m:.0f} m of the straight way" in text
