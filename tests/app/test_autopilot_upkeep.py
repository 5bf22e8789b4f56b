"""What is kept in step with the autopilot while a voyage lasts."""

import asyncio
from types import SimpleNamespace

from companion.app.autopilot_upkeep import keep_parameters
from companion.clock import run_virtual
from companion.fold import ToldParameters
from companion.mavlink.wire import RANGES


def test_a_parameter_that_seems_to_have_been_set_is_asked_for_again_whether_a_voyage_reads_it_or_not():
    parameters, asked = ToldParameters(), []
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
