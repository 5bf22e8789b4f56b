"""The mark in our missions: it outlives the autopilot's storage and names nobody else's."""

import asyncio
import struct
from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from companion.clock import run, run_virtual
from companion.mavlink.autopilot import Autopilot
from companion.mavlink.link import Link
from companion.mavlink.transports import open_link
from companion.messages import Command, GeoPoint, MissionItem, waypoint
from companion.skipper.board.mark import are_marked, is_remnant, marked
from sitl.ardurover.simulation import ArduRover, find
from sitl.autopilot import HOME, AutopilotConfig, MemoryLink, SimulatedAutopilot, serve
from sitl.world.environment import Constant

PLACES = st.builds(GeoPoint, lat_deg=st.floats(-89.0, 89.0), lon_deg=st.floats(-179.0, 179.0))
ITEMS = st.lists(
    st.builds(
        lambda p, c: waypoint(p, command=c), PLACES, st.sampled_from([Command.NAV_WAYPOINT, Command.NAV_LOITER_UNLIM])
    ),
    min_size=1,
    max_size=8,
)
CHECK = settings(max_examples=200)


def as_ardupilot_keeps(alt_m):
    """Return an altitude after AP_Mission: a float on the wire, cut to whole centimetres, divided again."""
    wire = struct.unpack("<f", struct.pack("<f", alt_m))[0]
    product = struct.unpack("<f", struct.pack("<f", wire * 100.0))[0]
    return struct.unpack("<f", struct.pack("<f", int(product) / 100.0))[0]


@CHECK
@given(ITEMS)
def test_it_is_known_again_after_the_autopilots_arithmetic(items):
    assert not are_marked(items)
    ours = marked(items)
    assert are_marked(ours)
    assert marked(ours) == ours
    assert are_marked([replace(item, alt_m=as_ardupilot_keeps(item.alt_m)) for item in ours])
    assert all(0.0 < item.alt_m < 42.0 and round(100.0 * item.alt_m) % 50 for item in ours)


@CHECK
@given(ITEMS, st.integers(0, 7), st.integers(1, 10_000))
def test_an_item_that_was_moved_or_changed_is_nobodys(items, which, by):
    ours = list(marked(items[:1]) + marked(items[1:]))
    ours = [replace(item, command=Command.NAV_WAYPOINT) for item in ours[:-1]] + ours[-1:]
    which %= len(ours)
    changed = [*marked(ours)]
    changed[which] = replace(changed[which], lat_e7=changed[which].lat_e7 + by)
    if marked(changed)[which].alt_m != changed[which].alt_m:  # one in 4096 has the mark of its new place
        assert not are_marked(changed)


def test_nobody_elses_lists_bear_it():
    assert not are_marked([])
    assert not are_marked([MissionItem(command=Command.NAV_RETURN_TO_LAUNCH)])
    there = GeoPoint(lat_deg=50.8, lon_deg=-1.3)
    for alt_m in (0.0, 1.0, 2.5, 10.0, 15.0, 20.0, 30.5, 40.0, 100.0):
        assert not any(
            are_marked([replace(waypoint(GeoPoint(lat_deg=50.8 + k / 1e5, lon_deg=-1.3)), alt_m=alt_m)])
            for k in range(500)
        )
    assert not are_marked([*marked([waypoint(there)]), waypoint(there)])


# All that a mission of ours is made of, over the whole range of marks.
OURS = marked(
    [
        *(waypoint(GeoPoint(lat_deg=50.81 + k / 1e4, lon_deg=-1.31)) for k in range(40)),
        waypoint(GeoPoint(lat_deg=50.82, lon_deg=-1.31), command=Command.NAV_LOITER_UNLIM),
        MissionItem(command=Command.NAV_RETURN_TO_LAUNCH),
    ]
)


async def stored(link, pilot, method):
    """Return OURS as an autopilot gives it back."""
    await link.wait_autopilot(60.0)
    assert (await pilot.upload_mission(OURS, method=method)).is_ok
    await asyncio.sleep(1.0)
    return (await pilot.read_mission()).items


@pytest.mark.parametrize("method", ["ftp", "items"])
def test_it_outlives_an_autopilots_storage(method):
    async def voyage():
        autopilot = SimulatedAutopilot(AutopilotConfig(is_warm=True), Constant(0.0, 5.0), seed=1)
        wires = MemoryLink("m", seed=1)
        async with serve(autopilot, [wires.far]), Link(wires.near) as link, Autopilot(link) as pilot:
            return await stored(link, pilot, method)

    assert are_marked(run_virtual(voyage()))


@pytest.mark.ardurover
@pytest.mark.skipif(find() is None, reason="no ardurover: run 'sitl fetch' or set $ARDUROVER")
@pytest.mark.parametrize("method", ["ftp", "items"])
def test_it_outlives_the_real_ones_storage_and_a_reboot(method, tmp_path):
    async def voyage():
        async with (
            ArduRover(find(), HOME, Constant(0.0, 5.0), speedup=8.0, folder=tmp_path) as boat,
            Link(open_link(boat.link)) as link,
            Autopilot(link) as pilot,
        ):
            before = await stored(link, pilot, method)
            await asyncio.sleep(10.0)
            boat.reboot()
            await asyncio.sleep(30.0)
            assert link.stats.reboots > 0
            return before, (await pilot.read_mission()).items

    for items in run(voyage(), speedup=8.0):
        assert len(items) == len(OURS)
        assert are_marked(items)


def test_a_mission_that_an_earlier_release_put_there_is_known():
    """The mark is on autopilots by now: another arithmetic would make strangers' missions of them."""
    ours = [
        waypoint(GeoPoint(lat_deg=50.8, lon_deg=-1.3)),
        waypoint(GeoPoint(lat_deg=-33.85, lon_deg=151.2), command=Command.NAV_LOITER_UNLIM),
    ]
    assert [item.alt_m for item in marked(ours)] == pytest.approx([3.084, 12.154], abs=1e-9)


DRAWN = [waypoint(GeoPoint(lat_deg=50.8 + 0.001 * n, lon_deg=-1.3)) for n in range(4)]
RETURN = MissionItem(command=Command.NAV_RETURN_TO_LAUNCH)
OURS = marked([waypoint(GeoPoint(lat_deg=50.9 + 0.001 * n, lon_deg=-1.2)) for n in range(4)])


@pytest.mark.parametrize("cut", [1, 2, 3, 4])
def test_an_upload_over_a_drawing_that_was_cut_short_is_ours_in_part(cut):
    """Its first items are written and the rest still stands: not a stranger's, for nobody drew that."""
    there = [*OURS[:cut], *DRAWN[cut:], RETURN]
    assert is_remnant(there, [*DRAWN, RETURN])
    kept = [replace(item, alt_m=12.0) for item in DRAWN]  # an altitude is no part of a drawing
    assert is_remnant([*OURS[:cut], *kept[cut:], RETURN], [*DRAWN, RETURN])


def test_a_drawing_itself_and_one_that_somebody_has_gone_on_with_are_no_remnant():
    moved = replace(DRAWN[3], lat_e7=DRAWN[3].lat_e7 + 10)
    assert not is_remnant([*DRAWN, RETURN], [*DRAWN, RETURN])
    assert not is_remnant([], DRAWN)
    assert not is_remnant([*OURS[:2], DRAWN[2], moved], DRAWN)
    assert not is_remnant([*OURS[:2], DRAWN[2], RETURN], DRAWN)  # home was not drawn
    assert not is_remnant([RETURN], [RETURN])
