"""Looking in from the shore, and leaving again, must not look to the autopilot like the loss of its ground station."""

import asyncio

import pytest

from companion.clock import run_virtual
from companion.mavlink.autopilot import Autopilot
from companion.mavlink.link import Link
from companion.mavlink.reception import SHORE, LinkIdentity
from companion.messages import Mode
from sitl.autopilot import AutopilotConfig, MemoryLink, SimulatedAutopilot, serve
from sitl.world.environment import Constant
from tests.mavlink.test_autopilot import mission, set_sail


@pytest.mark.parametrize(
    ("identity", "mode"),
    [
        (SHORE, Mode.AUTO),
        (LinkIdentity(system=255, component=190), Mode.HOLD),  # the second as `companion status` did
    ],
)
def test_who_looked_in_and_left_is_no_station_that_was_lost(identity, mode):
    async def work():
        boat = SimulatedAutopilot(
            AutopilotConfig(is_warm=True, parameters={"FS_GCS_ENABLE": 1.0, "FS_ACTION": 2.0}),
            Constant(0.0, 5.0),
            seed=1,
        )
        on_board, ashore = MemoryLink("on board"), MemoryLink("ashore")
        async with serve(boat, [on_board.far, ashore.far]), Link(on_board.near) as link, Autopilot(link) as autopilot:
            await set_sail(autopilot, mission(2))
            async with Link(ashore.near, identity=identity, streams=(), is_quiet=True) as shore:
                await shore.wait_autopilot()
                await asyncio.sleep(3.0)
            await asyncio.sleep(15.0)
            return boat.truth.mode

    assert run_virtual(work()) is mode
