"""Valid frames of every message with random payloads, from the autopilot, while everything is going on."""

import asyncio
import random

from pymavlink.dialects.v20 import ardupilotmega as wire

from companion.clock import run_virtual
from companion.mavlink.autopilot import Autopilot
from companion.mavlink.link import Link
from companion.mavlink.microservices.command import CommandSend, Party
from companion.mavlink.microservices.ftp import FtpRead, FtpWrite
from companion.mavlink.microservices.mission import ListDownload, ListUpload
from companion.mavlink.microservices.parameters import ParamList, ParamRead, ParamSet
from companion.mavlink.wire.assembler import VehicleAssembler
from companion.mavlink.wire.companion_status import StatusReader
from companion.messages import MissionItem, MissionType
from sitl.autopilot import MemoryLink

PARTY = Party(1, 1, 1, 191)
ITEMS = [MissionItem(command=16, lat_e7=511000000, lon_e7=-13000000)] * 3
BEAT = wire.MAVLink_heartbeat_message(11, 3, 0, 4, 3, 3)
# Messages that the machines listen to come more often than the rest.
TALK = [
    wire.mavlink_map[getattr(wire, f"MAVLINK_MSG_ID_{name}")]
    for name in (
        "MISSION_REQUEST",
        "MISSION_REQUEST_INT",
        "MISSION_ACK",
        "MISSION_COUNT",
        "MISSION_ITEM_INT",
        "MISSION_ITEM",
        "COMMAND_ACK",
        "PARAM_VALUE",
        "FILE_TRANSFER_PROTOCOL",
        "STATUSTEXT",
        "HEARTBEAT",
        "MISSION_CURRENT",
        "GLOBAL_POSITION_INT",
        "ATTITUDE",
        "TUNNEL",
        "WIND_COV",
        "NAMED_VALUE_FLOAT",
        "AIS_VESSEL",
        "COMMAND_LONG",
        "HOME_POSITION",
        "AUTOPILOT_VERSION",
    )
]


def frame(rng, seq):
    """Return a frame that passes every checksum and means nothing."""
    kind = rng.choice(TALK if rng.random() < 0.8 else list(wire.mavlink_map.values()))
    payload = bytearray(rng.randbytes(kind.unpacker.size))
    for i in range(len(payload)):
        if rng.random() < 0.6:
            payload[i] = rng.choice((0, 0, 1, 191, 1, 2, 16, 255))
    component = rng.choice((1, 1, 1, 191, 0, 154))
    head = bytes([len(payload), 0, 0, seq & 0xFF, rng.choice((1, 1, 1, 255)), component])
    head += kind.id.to_bytes(3, "little")
    crc = wire.x25crc(head + bytes(payload) + bytes([kind.crc_extra])).crc
    return b"\xfd" + head + bytes(payload) + crc.to_bytes(2, "little")


def machines():
    kind = MissionType.MISSION
    return [
        ListUpload(PARTY, kind, ITEMS),
        ListUpload(PARTY, kind, ITEMS, first=2, partial=True),
        ListDownload(PARTY, kind),
        CommandSend(PARTY, 1, ()),
        ParamRead(PARTY, ["A"]),
        ParamSet(PARTY, "A", 1.0),
        ParamList(PARTY),
        FtpWrite(PARTY, "x", b"y" * 500),
        FtpRead(PARTY, "x"),
    ]


def test_nothing_that_the_autopilot_can_say_raises():
    rng = random.Random(5)

    async def main():
        raised = []
        asyncio.get_running_loop().set_exception_handler(lambda _, context: raised.append(context))
        memory = MemoryLink(seed=1)
        await memory.far.open(lambda _: None)
        async with Link(memory.near) as link:
            _, reader, second = Autopilot(link), StatusReader(), VehicleAssembler()
            link.subscribe(reader.take)
            link.subscribe(second.take)
            link.on_command = lambda _: 0
            mav = wire.MAVLink(None, 1, 1)
            memory.far.write(BEAT.pack(mav))
            talking = []
            for i in range(15_000):
                if i % 60 == 0:
                    talking = machines()
                    for machine in talking:
                        link.send(*machine.start(0.0))
                data = frame(rng, i)
                memory.far.write(data)
                await asyncio.sleep(0.0)
                for message in link._codec.__class__(1, 191).feed(data):
                    for machine in talking:
                        link.send(*machine.receive(float(i), message))
                if i % 20 == 0:
                    for machine in talking:
                        if machine.result is None:
                            link.send(*machine.tick(machine.wake_s))
                    await asyncio.sleep(0.5)
                reader.report(float(i))
            frames_in = link.stats.frames_in
        assert frames_in > 14_000
        assert not raised

    run_virtual(main())
