"""The real ArduRover in its simulator, run with our weather.

``ArduRover`` is an async context manager around the program: a folder of its own, our parameters, free ports, the
wind set live from a ``Wind``. A harness port of its own sets the wind and reads what only the simulator knows
(SIMSTATE), so the companion's ports stay as a real boat's. ``require`` finds the program, ``fetch`` downloads it.
"""

from __future__ import annotations

import asyncio
import contextlib
import math
import os
import platform
import shutil
import socket
import subprocess
import tempfile
import time
import urllib.error
import urllib.request
from collections.abc import Mapping
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from pymavlink.dialects.v20 import ardupilotmega as mav

from companion.clock import ended, now_s
from companion.errors import InputError, JobError, LinkError
from companion.geo.angles import wrap_two_pi
from companion.geo.frame import LocalFrame
from companion.mavlink.transports import open_link
from companion.messages import GeoPoint, Mode
from sitl.autopilot import FORCED_REBOOT, Truth
from sitl.world import LEAST_M, MOST_M, SimulatedSounder, Waters, WindModel

URL = "https://firmware.ardupilot.org/Rover/stable/SITL_x86_64_linux_gnu/ardurover"
_SMALLEST_BYTES = 1_000_000


def fetched_path() -> Path:
    """Return where ``sitl fetch`` puts the program."""
    cache = os.environ.get("XDG_CACHE_HOME")
    return (Path(cache) if cache else Path.home() / ".cache") / "sailboat-companion" / "ardurover"


def find(path: Path | None = None) -> Path | None:
    """Return the program: ``path``, $ARDUROVER, on the PATH, or the fetched one; None if there is none.

    Raises:
        InputError: a place was named and there is no program there.
    """
    for source, named in (("--ardurover", path), ("$ARDUROVER", os.environ.get("ARDUROVER"))):
        if named:
            candidate = Path(named)
            if not (candidate.is_file() and os.access(candidate, os.X_OK)):
                raise InputError(source, str(candidate), "is no program", "name the ardurover executable")
            return candidate
    on_path = shutil.which("ardurover")
    if on_path:
        return Path(on_path)
    fetched = fetched_path()
    return fetched if fetched.is_file() else None


def require(path: Path | None = None) -> Path:
    """Return the program as ``find`` does.

    Raises:
        JobError: there is none.
    """
    found = find(path)
    if found is None:
        raise JobError("no ardurover here: run 'sitl fetch', or give --ardurover PATH, or set $ARDUROVER")
    return found


def fetch(url: str, target: Path, *, timeout_s: float) -> str:
    """Download the program, check it and put it at ``target``; return what it says of itself.

    Raises:
        JobError: no network, or what came is not the program; nothing is left behind.
    """
    if not url.startswith(("https://", "http://", "file://")):
        raise InputError("--url", url, "is not an address", "write https://...")
    if platform.system() != "Linux" or platform.machine() not in {"x86_64", "AMD64"}:
        here = f"{platform.system()} {platform.machine()}"
        raise JobError(f"the official simulator is for Linux on x86-64, this is {here}")
    host = url.split("/")[2] or url
    deadline = time.monotonic() + timeout_s
    target.parent.mkdir(parents=True, exist_ok=True)
    partial = target.with_name(target.name + ".partial")
    try:
        with urllib.request.urlopen(url, timeout=min(20.0, timeout_s)) as answer, partial.open("wb") as out:  # noqa: S310
            expected = answer.headers.get("Content-Length")
            while piece := answer.read(1 << 16):
                out.write(piece)
                if time.monotonic() > deadline:
                    raise JobError(f"{host}: the download took longer than {timeout_s:.0f} s")
        size = partial.stat().st_size
        if expected is not None and size != int(expected):
            raise JobError(f"{host}: got {size} of {expected} bytes")
        version = check(partial)
        partial.chmod(0o755)
        partial.replace(target)
    except (urllib.error.URLError, OSError) as error:
        reason = getattr(error, "reason", error)
        raise JobError(f"{host} cannot be reached ({reason}); is there a network?") from error
    finally:
        partial.unlink(missing_ok=True)
    return version


def check(path: Path) -> str:
    """Return "N bytes, answers --help" for a program that is what it should be.

    Raises:
        JobError: too small, not an x86-64 ELF file, or not ArduPilot's.
    """
    size = path.stat().st_size
    with path.open("rb") as stream:
        head = stream.read(20)
    if size < _SMALLEST_BYTES:
        raise JobError(f"what came is {size} bytes, too small for ArduRover")
    # ELF magic, 64 bit, little-endian, machine 62 = x86-64
    if head[:6] != b"\x7fELF\x02\x01" or head[18:20] != b"\x3e\x00":
        raise JobError("what came is not a Linux x86-64 program")
    path.chmod(0o755)
    try:
        with tempfile.TemporaryDirectory() as folder:
            shown = subprocess.run(  # noqa: S603
                [str(path.resolve()), "--help"], capture_output=True, text=True, timeout=20.0, cwd=folder, check=False
            )
    except (OSError, subprocess.TimeoutExpired) as error:
        raise JobError(f"what came does not run here ({error})") from error
    if "--model" not in shown.stdout + shown.stderr:
        raise JobError("what came does not answer --help as ArduPilot's simulator does")
    return f"{size} bytes, answers --help"


DEFAULTS = Path(__file__).with_name("sailboat.parm")
MOTOR = "-motor"  # of a model: the hull with an auxiliary motor
THROTTLE = ("SERVO3_FUNCTION 70", "SERVO3_MIN 1000", "SERVO3_MAX 2000", "SERVO3_TRIM 1500")
_WIND_HZ = 5.0
_WIND = ("SIM_WIND_DIR", "SIM_WIND_SPD")
_TIDE = ("SIM_TIDE_DIR", "SIM_TIDE_SPEED")
_WIND_REPEAT_S = 5.0
_SOUNDER = {  # a rangefinder that looks down and is told by MAVLink; its reach by the names of 4.7 and of before
    "RNGFND1_TYPE": 10.0,
    "RNGFND1_ORIENT": float(mav.MAV_SENSOR_ROTATION_PITCH_270),
    "RNGFND1_MIN": LEAST_M,
    "RNGFND1_MAX": MOST_M,
    "RNGFND1_MIN_CM": 100.0 * LEAST_M,
    "RNGFND1_MAX_CM": 100.0 * MOST_M,
}
_INSTANCES = 20
_HARNESS = (250, mav.MAV_COMP_ID_MISSIONPLANNER)
_EKF_READY = mav.EKF_ATTITUDE | mav.EKF_VELOCITY_HORIZ | mav.EKF_POS_HORIZ_ABS
_READY_SIM_S = 90.0
_KNOWN_MODES = {int(mode): mode for mode in Mode}


class ArduRover:
    """One running simulator.

    Args:
        program: the executable, see ``require``.
        home: where the boat lies at power-up.
        wind: the weather, from the moment that the boat is ready (t = 0 there).
        heading_rad: of the bow at power-up.
        speedup: simulated seconds per second; run the event loop with the same (``clock.run(.., speedup=..)``).
        instance: chooses the ports (5760 + 10 instance); the first free one when None.
        parameters: set besides those of the model's file, sailboat.parm or motorboat.parm.
        folder: where it keeps eeprom and logs; a temporary one when None.
        model: of the simulator; ``sailboat-motor`` has a throttle.
        waters: wind and stream by place, told as they are where the boat is.
        sounder: of the bottom under her: each ping goes to the autopilot, which tells it on as its rangefinder's.

    ``link`` is the companion's LINK, ``shore_link`` another port (SERIAL2) for a ground station.
    """

    def __init__(
        self,
        program: Path,
        home: GeoPoint,
        wind: WindModel,
        *,
        heading_rad: float = 0.0,
        speedup: float = 1.0,
        instance: int | None = None,
        parameters: Mapping[str, float] | None = None,
        folder: Path | None = None,
        model: str = "sailboat",
        waters: Waters | None = None,
        sounder: SimulatedSounder | None = None,
    ) -> None:
        self._program, self._home, self._wind = program.resolve(), home, wind
        self._heading_rad, self._speedup = heading_rad, speedup
        self._wanted = instance
        self._parameters = {**(_SOUNDER if sounder is not None else {}), **(parameters or {})}
        self._sounder = sounder
        self._folder, self._model = folder, model
        self._waters = waters
        self._set_en_mps = (0.0, 0.0)
        self._stack = contextlib.AsyncExitStack()
        self._process: asyncio.subprocess.Process | None = None
        self._harness: Any = None
        self._codec = mav.MAVLink(None, srcSystem=_HARNESS[0], srcComponent=_HARNESS[1])
        self._codec.robust_parsing = True
        self._frame = LocalFrame(home)
        self._ready = asyncio.Event()
        self._boot_s, self._boot_at_s, self._zero_boot_s = 0.0, 0.0, 0.0
        self._seen: dict[str, Any] = {}
        self._tacks = 0
        self._is_heard = False
        self.instance = 0
        self.texts: list[tuple[float, int, str]] = []

    # ------------------------------------------------------------------------------------------------ life
    async def __aenter__(self) -> Self:
        """Start it and wait until its position is ready.

        Raises:
            JobError: it ended, or does not answer.
        """
        try:
            await self._start()
        except BaseException:
            await self._stack.aclose()
            raise
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Stop it."""
        await self._stack.aclose()

    async def _start(self) -> None:
        folder = self._folder
        if folder is None:
            folder = Path(self._stack.enter_context(tempfile.TemporaryDirectory(prefix="ardurover-")))
        folder.mkdir(parents=True, exist_ok=True)
        defaults = folder / "boat.parm"
        hull = self._model.removesuffix(MOTOR)
        common = DEFAULTS.with_name(f"{hull}.parm").read_text()
        motor = THROTTLE if hull != self._model else ()
        lines = [common, *motor, *(f"{name} {value:g}" for name, value in self._parameters.items())]
        defaults.write_text("\n".join(lines) + "\n")
        self.instance = free_instance() if self._wanted is None else self._wanted
        heading_deg = math.degrees(wrap_two_pi(self._heading_rad))
        log = self._stack.enter_context((folder / "ardurover.log").open("wb"))
        self._process = await asyncio.create_subprocess_exec(
            str(self._program),
            "--model",
            self._model,
            "--speedup",
            f"{self._speedup:g}",
            "-I",
            str(self.instance),
            "--home",
            f"{self._home.lat_deg:.7f},{self._home.lon_deg:.7f},0,{heading_deg:.3f}",
            "--defaults",
            str(defaults),
            "-w",
            "--serial0",
            "tcp:0",
            "--serial1",
            "tcp:2",
            "--serial2",
            "tcp:3",
            cwd=folder,
            stdout=log,
            stderr=asyncio.subprocess.STDOUT,
            stdin=asyncio.subprocess.DEVNULL,
        )
        self._stack.push_async_callback(self._stop)
        await self._wait_for_port(folder)
        self._harness = open_link(f"tcp:127.0.0.1:{5762 + 10 * self.instance}")
        await self._harness.open(self._received)
        self._stack.push_async_callback(self._harness.close)
        life = asyncio.create_task(self._live(), name="ardurover harness")
        self._stack.push_async_callback(ended, life)
        try:
            async with asyncio.timeout(_READY_SIM_S + 10.0 * self._speedup):
                while not self._ready.is_set():
                    if self._process.returncode is not None:
                        raise JobError(f"ardurover ended with {self._process.returncode}: {_tail(folder)}")
                    with contextlib.suppress(TimeoutError):
                        async with asyncio.timeout(0.2 * self._speedup):
                            await self._ready.wait()
        except TimeoutError:
            raise JobError(f"ardurover has no position after {_READY_SIM_S:.0f} s: {_tail(folder)}") from None
        self._zero_boot_s = self._boot_s

    async def _wait_for_port(self, folder: Path) -> None:
        assert self._process is not None
        for _ in range(100):
            if self._process.returncode is not None:
                raise JobError(f"ardurover ended with {self._process.returncode}: {_tail(folder)}")
            if not _is_free(5762 + 10 * self.instance):
                return
            await asyncio.sleep(0.1 * self._speedup)
        raise JobError(f"ardurover opened no port within 10 s: {_tail(folder)}")

    async def _stop(self) -> None:
        process = self._process
        if process is None or process.returncode is not None:
            return
        process.terminate()
        try:
            async with asyncio.timeout(3.0 * self._speedup):
                await process.wait()
        except TimeoutError:
            process.kill()
            await process.wait()

    # --------------------------------------------------------------------------------------------- harness
    @property
    def link(self) -> str:
        """LINK of the companion's port (SERIAL0)."""
        return f"tcp:127.0.0.1:{5760 + 10 * self.instance}"

    @property
    def shore_link(self) -> str:
        """LINK of another port (SERIAL2)."""
        return f"tcp:127.0.0.1:{5763 + 10 * self.instance}"

    @property
    def t_s(self) -> float:
        """Simulated time since the boat was ready [s]: the autopilot's clock, carried on between messages."""
        return self._boot_s - self._zero_boot_s + min(1.0, max(0.0, now_s() - self._boot_at_s))

    def set_parameter(self, name: str, value: float) -> None:
        """Set a parameter from the harness."""
        self._send(mav.MAVLink_param_set_message(1, 1, name.encode(), value, mav.MAV_PARAM_TYPE_REAL32))

    def command(self, command: int, *params: float) -> None:
        """Send COMMAND_LONG from the harness: the operator's hand in a scenario."""
        given = [*params, *([0.0] * 7)][:7]
        self._send(mav.MAVLink_command_long_message(1, 1, command, 0, *given))

    def set_mode(self, mode: Mode) -> None:
        """The operator's switch."""
        self.command(mav.MAV_CMD_DO_SET_MODE, 1.0, float(mode))

    def reboot(self) -> None:
        """Restart the autopilot."""
        self.command(mav.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN, *FORCED_REBOOT)

    def set_current(self, set_to_rad: float, drift_mps: float) -> None:
        """Let the water run towards ``set_to_rad``, beside the stream of its waters."""
        self._set_en_mps = drift_mps * math.sin(set_to_rad), drift_mps * math.cos(set_to_rad)
        for name, value in zip(_TIDE, _tide(self._set_en_mps), strict=True):
            self.set_parameter(name, value)

    def set_gps_jump(self, lat_deg: float, lon_deg: float) -> None:
        """Let the receiver err by so much; by the names of 4.5 and of 4.7, of which one is known to it."""
        for prefix in ("SIM_GPS_GLITCH", "SIM_GPS1_GLTCH"):
            self.set_parameter(f"{prefix}_X", lat_deg)
            self.set_parameter(f"{prefix}_Y", lon_deg)

    def set_gps(self, *, is_lost: bool) -> None:
        """Take the receiver away, or give it back; by the names of 4.5 and of 4.7."""
        self.set_parameter("SIM_GPS_DISABLE", float(is_lost))
        self.set_parameter("SIM_GPS1_ENABLE", float(not is_lost))

    @property
    def truth(self) -> Truth:
        """What is so, from the simulator's own messages and the weather.

        Raises:
            LinkError: nothing was heard yet.
        """
        sim, moving = self._seen.get("SIMSTATE"), self._seen.get("GLOBAL_POSITION_INT")
        if sim is None or moving is None:
            raise LinkError("the simulator has not told its state yet")
        position = GeoPoint(lat_deg=sim.lat / 1e7, lon_deg=sim.lng / 1e7)
        east, north = self._frame.en_from_geo(position)
        ve, vn = moving.vy / 100.0, moving.vx / 100.0
        beat, mission = (self._seen.get(n) for n in ("HEARTBEAT", "MISSION_CURRENT"))
        twd, tws = self._wind_here()
        return Truth(
            t_s=self.t_s,
            boot_s=self._boot_s,
            east_m=east,
            north_m=north,
            position=position,
            heading_rad=wrap_two_pi(sim.yaw),
            speed_mps=math.hypot(ve, vn),
            velocity_en_mps=(ve, vn),
            twd_from_rad=twd,
            tws_mps=tws,
            mode=_KNOWN_MODES.get(beat.custom_mode, Mode.HOLD) if beat else Mode.INITIALISING,
            is_armed=bool(beat and beat.base_mode & mav.MAV_MODE_FLAG_SAFETY_ARMED),
            mission_seq=mission.seq if mission else 0,
            tacks=self._tacks,
        )

    def _send(self, message: Any) -> None:
        self._harness.write(message.pack(self._codec))
        self._codec.seq = (self._codec.seq + 1) & 0xFF

    def _received(self, data: bytes) -> None:
        for m in self._codec.parse_buffer(data) or ():
            name = m.get_type()
            if name == "BAD_DATA" or m.get_srcSystem() != 1 or m.get_srcComponent() != 1:
                continue
            self._seen[name] = m
            if name == "SYSTEM_TIME" or (name == "ATTITUDE" and m.time_boot_ms):
                self._boot_s, self._boot_at_s = m.time_boot_ms / 1000.0, now_s()
            elif name == "EKF_STATUS_REPORT":
                if m.flags & _EKF_READY == _EKF_READY and not m.flags & mav.EKF_CONST_POS_MODE:
                    self._ready.set()
            elif name == "STATUSTEXT":
                self._tacks += m.text == "Sailboat: Tacking"
                if len(self.texts) < 10_000 and not m.text.startswith("Field Elevation"):
                    self.texts.append((self._boot_s, m.severity, m.text))
            elif name == "HEARTBEAT" and not self._is_heard:
                self._is_heard = True
                for msgid, hertz in (
                    (mav.MAVLINK_MSG_ID_SIMSTATE, 5),
                    (mav.MAVLINK_MSG_ID_GLOBAL_POSITION_INT, 5),
                    (mav.MAVLINK_MSG_ID_ATTITUDE, 5),
                    (mav.MAVLINK_MSG_ID_SERVO_OUTPUT_RAW, 2),
                ):
                    self.command(mav.MAV_CMD_SET_MESSAGE_INTERVAL, float(msgid), 1e6 / hertz)

    async def _live(self) -> None:
        """Heartbeat, the wind as it is now, and the depth."""
        beat_s = told_s = -math.inf
        told: tuple[float, ...] | None = None
        while True:
            if now_s() - beat_s >= 1.0:
                beat_s = now_s()
                self._send(mav.MAVLink_heartbeat_message(mav.MAV_TYPE_ONBOARD_CONTROLLER, 8, 0, 0, 4, 3))
            if self._ready.is_set():
                twd, tws = self._wind_here()
                weather = round(math.degrees(twd), 3), round(tws, 4), *self._stream_here()
                # again now and then, in case a setting was lost on the way
                if weather != told or now_s() - told_s > _WIND_REPEAT_S:
                    told, told_s = weather, now_s()
                    for name, value in zip((*_WIND, *_TIDE), weather, strict=False):
                        self.set_parameter(name, value)
                if self._sounder is not None:
                    self._ping(self._sounder)
            await asyncio.sleep(1.0 / _WIND_HZ)

    def _ping(self, sounder: SimulatedSounder) -> None:
        """Tell the autopilot the depth here; nothing where no echo comes back."""
        sim = self._seen.get("SIMSTATE")
        if sim is None:
            return
        depth_m = sounder.ping_m(GeoPoint(lat_deg=sim.lat / 1e7, lon_deg=sim.lng / 1e7), max(0.0, self.t_s))
        if depth_m is not None:
            self._send(
                mav.MAVLink_distance_sensor_message(
                    round(1000.0 * self._boot_s),
                    round(100.0 * LEAST_M),
                    round(100.0 * MOST_M),
                    round(100.0 * depth_m),
                    mav.MAV_DISTANCE_SENSOR_ULTRASOUND,
                    0,
                    mav.MAV_SENSOR_ROTATION_PITCH_270,
                    255,
                )
            )

    def _wind_here(self) -> tuple[float, float]:
        t_s = max(0.0, self.t_s)
        return self._wind.at(t_s) if self._waters is None else self._waters.wind_at(t_s, self._place())

    def _stream_here(self) -> tuple[float, ...]:
        """Return where the water comes from [deg] and how fast it runs [m/s]; nothing where it is not ours to say."""
        if self._waters is None:
            return ()
        east, north = self._waters.stream_at(max(0.0, self.t_s), self._place())
        return _tide((self._set_en_mps[0] + east, self._set_en_mps[1] + north))

    def _place(self) -> tuple[float, float]:
        sim = self._seen.get("SIMSTATE")
        if sim is None:
            return 0.0, 0.0
        return self._frame.en_from_geo(GeoPoint(lat_deg=sim.lat / 1e7, lon_deg=sim.lng / 1e7))


def _tide(stream_en_mps: tuple[float, float]) -> tuple[float, float]:
    """Return a stream as the simulator is told of it: where it comes from [deg], how fast it runs [m/s]."""
    east, north = stream_en_mps
    return round(math.degrees(wrap_two_pi(math.atan2(-east, -north))), 2), round(math.hypot(east, north), 3)


def _is_free(port: int) -> bool:
    with socket.socket(socket.AF_INET, socket.SOCK_STREAM) as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind(("127.0.0.1", port))
        except OSError:
            return False
    return True


def free_instance() -> int:
    """Return the first instance whose ports nobody has.

    Raises:
        JobError: all are taken.
    """
    for instance in range(_INSTANCES):
        if all(_is_free(base + 10 * instance) for base in (5760, 5762, 5763)):
            return instance
    raise JobError(f"the ports of all {_INSTANCES} simulator instances are taken; stop some")


def _tail(folder: Path) -> str:
    try:
        lines = (folder / "ardurover.log").read_text(errors="replace").strip().splitlines()
    except OSError:
        lines = []
    return " / ".join(lines[-3:]) or "it said nothing"
