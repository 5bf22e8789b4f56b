"""How often the truth of a long voyage is watched: seldom, and beside another vessel as on a short one."""

import asyncio
import contextlib
import math
from types import SimpleNamespace

import numpy as np
import pytest

from companion.clock import now_s, run_virtual
from companion.geo.frame import LocalFrame
from companion.messages import GeoPoint, Mode
from sitl.run.embedded import _watch_truth
from sitl.scenario import EventSpec, Others, TrueTrack
from sitl.world import Constant

DAY_S = 86_400.0
ORIGIN = GeoPoint(lat_deg=44.0, lon_deg=-5.0)
FRAME = LocalFrame(ORIGIN)
# she lies still, and a ship goes by at 8 m/s, 100 m to the east
PASSES = EventSpec(at_s=0.0, kind="vessel", east_m=100.0, north_m=-9000.0, sog_mps=8.0, for_s=2400.0)


async def watched(days):
    truth = TrueTrack()
    others = Others(FRAME, Constant(0.0, 5.0), 0, port=0, hear=lambda _: None)
    at = SimpleNamespace(
        position=ORIGIN, heading_rad=0.0, speed_mps=0.0, twd_from_rad=0.0, tws_mps=5.0, is_armed=True, mode=Mode.AUTO
    )
    world = SimpleNamespace(
        autopilot=SimpleNamespace(truth=at), set_sail_s=None, truth=truth, others=others, observer=None
    )
    tasks = [
        asyncio.create_task(_watch_truth(world, FRAME, days * DAY_S)),
        asyncio.create_task(others.play(PASSES, now_s(), lambda: (((0.0, 0.0), (0.0, 0.0)), 0.0))),
    ]
    await asyncio.sleep(DAY_S)
    for task in tasks:
        task.cancel()
        with contextlib.suppress(asyncio.CancelledError):
            await task
    return truth


def test_a_ship_that_passes_on_a_voyage_of_weeks_is_measured_where_she_is_nearest():
    """Looked at every 95 s it had gone 760 m meanwhile."""
    truth = run_virtual(watched(22.0))
    assert truth.vessels_m["211000001"] == pytest.approx(100.0 - 8.0, abs=0.5)  # half a beam off its middle
    apart = np.diff(truth.t_s)
    assert float(np.max(apart)) == pytest.approx(22.0 * DAY_S / 20_000, rel=0.01)
    assert math.isclose(float(np.min(apart)), 0.25, rel_tol=0.01)
    assert len(truth.t_s) < 5000
