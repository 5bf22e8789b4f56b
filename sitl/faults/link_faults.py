"""Faults of the link in live runs: a relay that loses what it is told to, and a false wind vane.

For live runs, where the autopilot's own vane cannot be broken (ArduRover's simulator has no such fault): the companion
hears a vane that is frozen, turned or restless, the autopilot itself sails by a good one. WIND is made again of the
false angle, with the heading and the velocity that went by last. Frames with a signature are not changed.

What the autopilot's own simulator cannot break, the vane, is broken here too.
"""

from __future__ import annotations

import asyncio
import contextlib
import math
import random
from types import TracebackType
from typing import Self

from pymavlink.dialects.v20 import ardupilotmega as mav

from companion.geo.angles import heading_of, wrap_pi, wrap_two_pi
from companion.mavlink.transports import open_link
from sitl.autopilot import FrameStream, Impairment, MemoryLink, VaneFault, VaneState
from sitl.scenario import EventSpec, free_port

_V2 = 0xFD
_READ = frozenset(
    {
        mav.MAVLINK_MSG_ID_ATTITUDE,
        mav.MAVLINK_MSG_ID_GLOBAL_POSITION_INT,
        mav.MAVLINK_MSG_ID_WIND,
        mav.MAVLINK_MSG_ID_NAMED_VALUE_FLOAT,
    }
)
SPIKES = 0.02  # one reading in fifty is anywhere, as the simulated autopilot's


class FaultyVane:
    """Changes the frames of one autopilot while ``fault`` is anything but OK."""

    def __init__(self, *, seed: int) -> None:
        self._rng = random.Random(seed)
        self._decoder = mav.MAVLink(None)
        self._decoder.robust_parsing = True
        self._heading_rad = 0.0
        self._velocity_en_mps = (0.0, 0.0)
        self._awa_rad: float | None = None  # of the vane as it is
        self._frozen_rad: float | None = None
        self._fault = VaneFault()

    def set(self, fault: VaneFault) -> None:
        """Break or mend it."""
        self._fault = fault
        self._frozen_rad = self._awa_rad

    def pass_on(self, frame: bytes) -> bytes:
        """Return a frame of the autopilot as the companion is to hear it."""
        if len(frame) < 12 or frame[0] != _V2 or frame[2] & 1 or int.from_bytes(frame[7:10], "little") not in _READ:
            return frame
        message = self._decoder.parse_char(frame)
        kind = "" if message is None else message.get_type()
        if kind == "ATTITUDE":
            self._heading_rad = message.yaw
        elif kind == "GLOBAL_POSITION_INT":
            self._velocity_en_mps = (message.vy / 100.0, message.vx / 100.0)
        elif kind == "WIND":
            return self._wind(frame, message)
        elif kind == "NAMED_VALUE_FLOAT" and message.name == "AppWndDir" and self._fault.state is not VaneState.OK:
            said = math.degrees(self._said(math.radians(message.value)))
            return self._packed(frame, mav.MAVLink_named_value_float_message(message.time_boot_ms, b"AppWndDir", said))
        return frame

    def _wind(self, frame: bytes, message: mav.MAVLink_wind_message) -> bytes:
        ve, vn = self._velocity_en_mps
        twd = math.radians(message.direction)
        east, north = message.speed * math.sin(twd) + ve, message.speed * math.cos(twd) + vn
        self._awa_rad = wrap_pi(heading_of(east, north) - self._heading_rad)
        if self._fault.state is VaneState.OK:
            return frame
        aws_mps, angle = math.hypot(east, north), self._heading_rad + self._said(self._awa_rad)
        east, north = aws_mps * math.sin(angle) - ve, aws_mps * math.cos(angle) - vn
        return self._packed(
            frame,
            mav.MAVLink_wind_message(
                math.degrees(wrap_two_pi(heading_of(east, north))), math.hypot(east, north), message.speed_z
            ),
        )

    def _said(self, awa_rad: float) -> float:
        """Return what the vane says where the wind is at ``awa_rad`` of the bow."""
        fault = self._fault
        if fault.state is VaneState.FROZEN:
            return awa_rad if self._frozen_rad is None else self._frozen_rad
        if fault.state is VaneState.OFFSET:
            return awa_rad + fault.value_rad
        is_spike = self._rng.random() < SPIKES
        return awa_rad + self._rng.uniform(-fault.value_rad, fault.value_rad) if is_spike else awa_rad

    @staticmethod
    def _packed(frame: bytes, message: mav.MAVLink_message) -> bytes:
        packer = mav.MAVLink(None, srcSystem=frame[5], srcComponent=frame[6])
        packer.seq = frame[4]
        return bytes(message.pack(packer))


LINK_EVENTS = frozenset({"link_cut", "link_half", "link_quality"})


async def impair(line: MemoryLink, event: EventSpec) -> None:
    """Cut or impair ``line`` as ``event`` says, and mend it after ``for_s``."""
    end = line.near if event.kind == "link_half" and event.its_state == "unheard" else line.far  # whose words are lost
    if event.kind == "link_cut":
        line.cut()
    elif event.kind == "link_half":
        end.is_mute = True
    else:
        line.impairment = Impairment(
            loss=event.loss,
            duplicate=event.duplicate,
            reorder=event.reorder,
            corrupt=event.corrupt,
            noise=event.noise,
            delay_s=event.delay_s,
        )
    if event.for_s is None:
        return
    await asyncio.sleep(event.for_s)
    if event.kind == "link_cut":
        line.mend()
    elif event.kind == "link_half":
        end.is_mute = False
    else:
        line.impairment = Impairment()


class Relay:
    """Between the companion's ``link`` and the autopilot's ``boat_link``; faults are those of ``line``, by frames."""

    def __init__(self, boat_link: str, *, seed: int) -> None:
        self.line = MemoryLink("relay", seed=seed)
        port = free_port()
        self.link = f"udpin:127.0.0.1:{port}"
        self._companion, self._boat = open_link(f"udpout:127.0.0.1:{port}"), open_link(boat_link)
        self.vane = FaultyVane(seed=seed)
        self._frames = FrameStream()
        self._stack = contextlib.AsyncExitStack()

    async def __aenter__(self) -> Self:
        """Connect both sides."""
        near, far = self.line.near, self.line.far
        await near.open(self._companion.write)
        await far.open(self._boat.write)
        for side, take in ((self._companion, near.write), (self._boat, self._from_boat)):
            await side.open(take)
            self._stack.push_async_callback(side.close)
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Hang up."""
        await self._stack.aclose()

    def _from_boat(self, data: bytes) -> None:
        """Take a piece of the autopilot's stream: a fault befalls one frame, not two halves."""
        for frame in self._frames.take(data):
            self.line.far.write(self.vane.pass_on(frame))
