"""The boat with its steering: orders carried out by the compiled loop; and its polar, tried in a steady wind."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from companion.boat import Polar
from companion.boat.boat import carried, coefficient_of
from companion.boat.rover import TACK_RETRY_S
from companion.geo.angles import wrap_pi, wrap_two_pi
from companion.geo.frame import LocalFrame
from companion.geo.shift import Shift
from companion.messages import GeoPoint
from sitl.autopilot.boat import kernel as k
from sitl.autopilot.boat.kernel import hash01, polar_table
from sitl.autopilot.boat.parameters import Parameters, fill
from sitl.autopilot.config import Departures
from sitl.world import Process, Waters, WindModel

_CACHE, _TOLD = 4096, 64


class HomeChart:
    """One frame for the hull, the mission and the fence; what was converted once is remembered."""

    def __init__(self, home: GeoPoint) -> None:
        self._frame = LocalFrame(home)
        self._seen: dict[tuple[int, int], tuple[float, float]] = {}
        self._told: dict[tuple[float, float], GeoPoint] = {}

    def follow(self, en: tuple[float, float]) -> Shift:
        """Let the metres count from a place from now on; return how those of before become those."""
        shift = Shift(self._frame, LocalFrame(self._frame.geo_from_en(*en)))
        self._frame = shift.after
        self._seen.clear()
        self._told.clear()
        return shift

    def point(self, en: tuple[float, float]) -> GeoPoint:
        """Return a position in metres as a GeoPoint."""
        found = self._told.get(en)
        if found is None:  # all that is told and looked at in a moment is of one place, and home is told for long
            if len(self._told) >= _TOLD:
                self._told.clear()
            found = self._told[en] = self._frame.geo_from_en(*en)
        return found

    def to_e7(self, en: tuple[float, float]) -> tuple[int, int]:
        """Return (lat, lon) x 1e7 of a position in metres."""
        point = self.point(en)
        return round(point.lat_deg * 1e7), round(point.lon_deg * 1e7)

    def to_en(self, lat_e7: int, lon_e7: int) -> tuple[float, float]:
        """Return (east, north) [m]; what is not on the globe is brought to its edge."""
        key = (max(-900_000_000, min(900_000_000, lat_e7)), max(-1_800_000_000, min(1_800_000_000, lon_e7)))
        found = self._seen.get(key)
        if found is None:
            if len(self._seen) >= _CACHE:
                self._seen.clear()
            point = GeoPoint(lat_deg=key[0] / 1e7, lon_deg=key[1] / 1e7)
            found = self._seen[key] = self._frame.en_from_geo(point)
        return found


_STEP_S = 0.1
_GPS_STREAMS = (11, 12)  # of the seed: east, north
_TACKS = 0x7AC4  # what tells the lots of tacks from a faulty vane's


class Surroundings:
    """Waters and departures of one boat. Times are since its start, places metres from its home."""

    def __init__(self, wind: WindModel, departures: Departures | None, waters: Waters | None, seed: int) -> None:
        self._wind, self._waters = wind, waters
        self._home: Shift | None = None  # from its metres to those that the waters are in, where they are others
        self.departures = departures or Departures()
        self._seed = seed
        sensors = self.departures.sensors
        self._gps = (
            [Process(1.0 / sensors.gps_noise_s, _STEP_S, seed, stream, from_mean=True) for stream in _GPS_STREAMS]
            if sensors.gps_noise_m > 0.0
            else []
        )

    def carry(self, shift: Shift) -> None:
        """Count the boat's metres from elsewhere."""
        self._home = Shift(shift.after, shift.before if self._home is None else self._home.after)

    def fill(self, settings: NDArray[np.float64]) -> None:
        """Set what stays as it is; after the parameters, to which the vane's error is added."""
        boat = self.departures
        settings[k.P_OTHER] = 1.0
        settings[k.P_LEEWAY] = coefficient_of(boat.leeway_rad)
        settings[k.P_BEAT], settings[k.P_REACH], settings[k.P_RUN] = boat.beat, boat.reach, boat.run
        settings[k.P_TACK_FAILS], settings[k.P_IRONS_S] = boat.tack_fails, boat.irons_s
        settings[k.P_VANE_OFFSET] += boat.sensors.vane_rad

    def wind_at(self, t_s: float, state: NDArray[np.float64]) -> tuple[float, float]:
        """Return the wind where the boat is: from [rad], speed [m/s]."""
        return self._wind.at(t_s) if self._waters is None else self._waters.wind_at(t_s, self._place(state))

    def look(
        self,
        t_s: float,
        state: NDArray[np.float64],
        tide_en_mps: tuple[float, float],
        jump_en_m: tuple[float, float],
        fault_rad: float,
    ) -> None:
        """Set what changes: stream, waves, what the boat's position and compass err by, the next tack's lot.

        ``tide_en_mps``, ``jump_en_m`` and ``fault_rad`` are what a scenario's events made of stream, position and
        compass; all is added to them.
        """
        waves, sensors = self.departures.waves, self.departures.sensors
        heading = float(state[k.S_YAW])
        east, north = (0.0, 0.0) if self._waters is None else self._waters.stream_at(t_s, self._place(state))
        state[k.S_CURRENT_E], state[k.S_CURRENT_N] = tide_en_mps[0] + east, tide_en_mps[1] + north
        state[k.S_SEA], state[k.S_WOBBLE] = waves.share(heading), waves.wobble_radps(t_s)
        state[k.S_COMPASS] = fault_rad + sensors.compass_error_rad(heading)
        noise = [sensors.gps_noise_m * process.at(t_s) for process in self._gps] or [0.0, 0.0]
        state[k.S_GPS_E] = jump_en_m[0] + noise[0] - sensors.gps_lag_s * state[k.S_VE]
        state[k.S_GPS_N] = jump_en_m[1] + noise[1] - sensors.gps_lag_s * state[k.S_VN]
        state[k.S_LOT] = hash01(self._seed ^ _TACKS, int(state[k.S_TRIES]))

    def _place(self, state: NDArray[np.float64]) -> tuple[float, float]:
        place = float(state[k.S_E]), float(state[k.S_N])
        return place if self._home is None else self._home.point(place)


LOOP_S = k.LOOP_S
_WIND_LOOPS = 5
_NONE = np.empty(0)
# What of the state is a place, a way, or an angle on the grid.
_PLACES = ((k.S_E, k.S_N), (k.S_OE, k.S_ON), (k.S_DE, k.S_DN), (k.S_XE, k.S_XN), (k.S_TE, k.S_TN), (k.S_LE, k.S_LN))
_WAYS = ((k.S_VE, k.S_VN), (k.S_PE, k.S_PN), (k.S_GPS_E, k.S_GPS_N))
_ANGLES = (k.S_YAW, k.S_NAV_YAW, k.S_BEARING, k.S_TACK_YAW, k.S_LOITER_YAW)


class Vehicle:
    """The boat on the water. Positions are (east, north) [m] from home, headings compass radians."""

    def __init__(
        self,
        wind: WindModel,
        parameters: Parameters,
        *,
        heading_rad: float,
        is_moored: bool,
        seed: int,
        polar: Polar | None = None,
        surroundings: Surroundings | None = None,
    ) -> None:
        self.state = np.zeros(k.S_SIZE)
        self.tick = 0  # loops since the start: the state's own count
        self.t_s = 0.0  # simulated time [s], of that count
        self.wind = wind
        self._parameters = parameters
        self._settings = np.zeros(k.P_SIZE)
        self._seen = -1
        self._seed = seed
        self._polar = np.zeros((0, 0)) if polar is None else polar_table(polar)
        self._full_tws_mps = math.inf if polar is None else polar.full_tws_mps
        self._still_until_s = 0.0
        self._surroundings = surroundings
        self._looked = -1  # the first loop of the tenth of a second for which they were looked at
        self._tide = self._jump = (0.0, 0.0)
        self._compass_rad = 0.0
        self.state[k.S_YAW] = heading_rad
        self.state[k.S_MOORED] = float(is_moored)
        self.state[k.S_TACK_END] = -TACK_RETRY_S
        self.load_parameters()
        # compiles the kernel, or loads it, now rather than in the middle of a voyage in real time
        k.advance(self.state, self._settings, np.zeros((1, 2)), 0, _NONE, 0, self._polar)

    # ------------------------------------------------------------------------------------------- time
    def load_parameters(self) -> None:
        """Take over the parameters if any changed."""
        if self._seen == self._parameters.revision:
            return
        self._seen = self._parameters.revision
        get = self._parameters.get
        fill(self._settings, get)
        tide_from = math.radians(get("SIM_TIDE_DIR"))
        self._tide = -get("SIM_TIDE_SPEED") * math.sin(tide_from), -get("SIM_TIDE_SPEED") * math.cos(tide_from)
        self.state[k.S_CURRENT_E], self.state[k.S_CURRENT_N] = self._tide
        if self._surroundings is not None:
            self._surroundings.fill(self._settings)

    def still_air(self) -> None:
        """SITL has no wind in the first seconds after boot."""
        self._still_until_s = k.WIND_DELAY_S
        self.state[k.S_WSPD] = 0.0

    def settle(self) -> None:
        """Let the air and the filters be as after a long time at rest."""
        s = self.state
        twd, tws = self.wind.at(self.t_s)
        s[k.S_WDIR], s[k.S_WSPD] = twd, tws
        self._still_until_s = 0.0
        s[k.S_AWS] = s[k.S_TWS] = tws
        awa = twd - s[k.S_YAW]
        s[k.S_AWA_RAW] = (awa + math.pi) % (2.0 * math.pi) - math.pi
        s[k.S_AWA_SIN], s[k.S_AWA_COS] = math.sin(awa), math.cos(awa)
        s[k.S_TWD_SIN], s[k.S_TWD_COS] = math.sin(twd), math.cos(twd)
        s[k.S_VANE_SET] = 1.0

    def advance(self, loops: int) -> tuple[int, int]:
        """Run up to ``loops`` loops; return (loops done, events)."""
        if self._surroundings is not None:
            return self._advance_among(self._surroundings, loops)
        first = self.tick + 1
        # the wind is asked for on a fixed grid of five loops, so chunks of any size see the same wind
        first -= first % _WIND_LOOPS
        count = (self.tick + loops - first) // _WIND_LOOPS + 1
        wind = np.empty((count, 2))
        for i in range(count):
            t_s = (first + i * _WIND_LOOPS) * LOOP_S
            twd, tws = self.wind.at(t_s)
            wind[i, 0], wind[i, 1] = twd, (tws if t_s >= self._still_until_s else 0.0)
        return self._loops(wind, first, loops)

    def _advance_among(self, surroundings: Surroundings, loops: int) -> tuple[int, int]:
        """Advance in pieces that end where the wind's grid does; at the first loop of each look about."""
        done = events = 0
        while done < loops and not events:
            first = self.tick + 1 - (self.tick + 1) % _WIND_LOOPS
            if first != self._looked:
                self._looked, t_s = first, first * LOOP_S
                surroundings.look(t_s, self.state, self._tide, self._jump, self._compass_rad)
                twd, tws = surroundings.wind_at(t_s, self.state)
                self._here = np.array([[twd, tws if t_s >= self._still_until_s else 0.0]])
                share = carried(twd - self.state[k.S_YAW], tws, self.state[k.S_V], self._full_tws_mps)
                self._settings[k.P_LEEWAY] = share * coefficient_of(surroundings.departures.leeway_rad)
            piece, events = self._loops(self._here, first, min(loops - done, first + _WIND_LOOPS - 1 - self.tick))
            done += piece
        return done, events

    def _loops(self, wind: NDArray[np.float64], first: int, loops: int) -> tuple[int, int]:
        noise = _NONE
        if self.state[k.S_VANE_FAULT] == k.FAULT_SPIKES:
            noise = np.array([hash01(self._seed, self.tick + 1 + i) for i in range(loops)])
        done, events = k.advance(self.state, self._settings, wind, first, noise, loops, self._polar)
        self.tick = int(self.state[k.S_TICK])
        self.t_s = self.tick * LOOP_S
        return int(done), int(events)

    def carry(self, shift: Shift) -> None:
        """Count in other metres: places are where they were, and what has a direction on their grid turns with it.

        Wind and current are of true north: they blow as before.
        """
        s = self.state
        for e, n in _PLACES:
            s[e], s[n] = shift.point((float(s[e]), float(s[n])))
        for e, n in _WAYS:
            s[e], s[n] = shift.vector((float(s[e]), float(s[n])))
        for angle in _ANGLES:
            s[angle] = wrap_pi(float(s[angle]) + shift.turn_rad)
        if self._surroundings is not None:
            self._surroundings.carry(shift)

    # ----------------------------------------------------------------------------------------- orders
    def hold(self) -> None:
        """Sheet eased, rudder centred."""
        self._steer(k.STEER_HOLD)

    def sticks_at_rest(self) -> None:
        """MANUAL with nobody at the sticks: rudder centred, sheet hauled in."""
        self._steer(k.STEER_OFF)

    def sail_leg(
        self,
        origin: tuple[float, float],
        destination: tuple[float, float],
        following: tuple[float, float] | None,
        *,
        is_corner: bool,
        goes_on: bool,
    ) -> None:
        """Follow the line from ``origin`` to ``destination``.

        Args:
            origin: where the line starts.
            destination: the waypoint.
            following: the waypoint after it, which shapes the corner.
            is_corner: the boat need not stop at the destination.
            goes_on: the boat has just passed the corner at ``origin``; its curve is finished first.
        """
        s = self.state
        goes_on = goes_on and s[k.S_STEER] == k.STEER_LEG and s[k.S_PHASE] == 2.0
        unit_before = _unit(s[k.S_DE] - s[k.S_OE], s[k.S_DN] - s[k.S_ON])
        curve_before = s[k.S_OUT]
        self._steer(k.STEER_LEG)
        s[k.S_OE], s[k.S_ON] = origin
        s[k.S_DE], s[k.S_DN] = destination
        s[k.S_FAST] = float(is_corner and following is not None)
        length = math.dist(origin, destination)
        unit = _unit(destination[0] - origin[0], destination[1] - origin[1])
        if goes_on:
            s[k.S_IN], s[k.S_PHASE] = curve_before, 0.0
            s[k.S_PE], s[k.S_PN] = unit_before
        else:
            s[k.S_IN], s[k.S_PHASE], s[k.S_U], s[k.S_SCALE] = 0.0, 1.0, 0.0, 1.0
            s[k.S_TE], s[k.S_TN] = origin
        s[k.S_OUT] = 0.0
        if s[k.S_FAST] and following is not None:
            s[k.S_XE], s[k.S_XN] = following
            after = _unit(following[0] - destination[0], following[1] - destination[1])
            half_turn = math.acos(max(-1.0, min(1.0, unit[0] * after[0] + unit[1] * after[1]))) / 2.0
            p = self._settings
            braking_m = p[k.P_WP_SPEED] ** 2 / (2.0 * p[k.P_ACCEL])
            radius_m = max(p[k.P_WP_RADIUS], p[k.P_TURN_RADIUS])
            curve_m = 2.0 * radius_m / max(math.sin(half_turn), 1e-3)
            s[k.S_OUT] = max(
                min(curve_m, braking_m, (length - s[k.S_IN]) * 0.5, math.dist(destination, following) * 0.5), 0.1
            )
        self._measure(destination)

    def leave_from_here(self) -> None:
        """The boat drifted while it waited: start its leg at the present position."""
        s = self.state
        s[k.S_OE], s[k.S_ON] = s[k.S_TE], s[k.S_TN] = self.position
        s[k.S_IN], s[k.S_PHASE], s[k.S_U], s[k.S_SCALE] = 0.0, 1.0, 0.0, 1.0
        self._measure(self.destination)

    @property
    def heading(self) -> float:
        """Heading [rad, -π..π), as the autopilot believes."""
        yaw = float(self.state[k.S_YAW] + self.state[k.S_COMPASS])
        return yaw if -math.pi <= yaw < math.pi else wrap_pi(yaw)

    def loiter(self) -> None:
        """Stay near where the boat could stop."""
        s = self.state
        s[k.S_LE], s[k.S_LN] = self.stopping_point()
        s[k.S_LOITER_YAW] = self.heading
        self._steer(k.STEER_LOITER)
        self._measure((s[k.S_LE], s[k.S_LN]))

    def steer_heading(self, heading_rad: float, thrust: float) -> None:
        """Hold a heading; ``thrust`` above 0 trims the sail."""
        self.state[k.S_WANT_YAW], self.state[k.S_THRUST] = heading_rad, thrust
        self._steer(k.STEER_HEADING)

    def steer_rate(self, rate_radps: float, thrust: float) -> None:
        """Turn at a rate."""
        self.state[k.S_WANT_TURN], self.state[k.S_THRUST] = rate_radps, thrust
        self._steer(k.STEER_RATE)

    def ask_tack(self) -> None:
        """Tack at the next opportunity; acts on an upwind route only."""
        self.state[k.S_TACK_ASKED] = max(self.t_s, LOOP_S)

    def set_armed(self, *, armed: bool) -> None:
        """Arm or disarm."""
        self.state[k.S_ARMED] = float(armed)

    def avoid(self, *, near: bool, ease: bool) -> None:
        """Tell what simple avoidance makes of the fence."""
        self.state[k.S_AVOID], self.state[k.S_EASE] = float(near), float(ease)

    def set_vane_fault(self, fault: int, value_rad: float) -> None:
        """Break or mend the wind vane."""
        self.state[k.S_VANE_FAULT], self.state[k.S_VANE_VALUE] = fault, value_rad

    def set_compass_error(self, error_rad: float) -> None:
        """Let the autopilot believe that it heads so much to starboard of where it does."""
        self._compass_rad = self.state[k.S_COMPASS] = error_rad

    def anchor(self, *, down: bool) -> None:
        """Let go the anchor, which holds at once, or weigh it."""
        self.state[k.S_MOORED] = k.ANCHORED if down else 0.0

    def run_motor(self, *, on: bool) -> None:
        """Run the auxiliary motor in place of the sails, or not."""
        self.state[k.S_MOTOR] = float(on)

    def set_position_error(self, east_m: float, north_m: float) -> None:
        """Let the autopilot believe that it is so far from where it is."""
        self._jump = self.state[k.S_GPS_E], self.state[k.S_GPS_N] = east_m, north_m

    def clear_tack(self) -> None:
        """A new mode knows no tack."""
        if self.state[k.S_TACKING]:
            self.state[k.S_TACKING], self.state[k.S_TACK_END] = 0.0, self.t_s

    def _steer(self, how: int) -> None:
        s = self.state
        if s[k.S_STEER] != how:
            s[k.S_INTEGRAL] = 0.0
            s[k.S_WANT_SPEED] = abs(s[k.S_V])
            s[k.S_WANT_RATE] = s[k.S_RATE]
            s[k.S_XTRACK] = 0.0
            s[k.S_L1_ANGLE] = s[k.S_L1_NUDGE] = 0.0
        s[k.S_STEER] = how

    def _measure(self, goal: tuple[float, float]) -> None:
        s = self.state
        east, north = self.position
        de, dn = goal[0] - east, goal[1] - north
        s[k.S_DIST], s[k.S_BEARING] = math.hypot(de, dn), math.atan2(de, dn)
        if s[k.S_STEER] == k.STEER_LEG:
            le, ln = s[k.S_DE] - s[k.S_OE], s[k.S_DN] - s[k.S_ON]
            length = math.hypot(le, ln)
            s[k.S_XTRACK] = ((north - s[k.S_ON]) * le - (east - s[k.S_OE]) * ln) / length if length > 1e-6 else 0.0

    # --------------------------------------------------------------------------------------- readings
    @property
    def position(self) -> tuple[float, float]:
        """East, north [m], as the autopilot believes."""
        s = self.state
        return float(s[k.S_E] + s[k.S_GPS_E]), float(s[k.S_N] + s[k.S_GPS_N])

    @property
    def true_position(self) -> tuple[float, float]:
        """East, north [m]."""
        return float(self.state[k.S_E]), float(self.state[k.S_N])

    @property
    def speed_mps(self) -> float:
        """Through the water, ahead."""
        return float(self.state[k.S_V])

    @property
    def destination(self) -> tuple[float, float]:
        """End of the present leg [m]."""
        return float(self.state[k.S_DE]), float(self.state[k.S_DN])

    @property
    def leg(self) -> tuple[tuple[float, float], tuple[float, float]]:
        """Where the present leg begins and ends [m]."""
        return (float(self.state[k.S_OE]), float(self.state[k.S_ON])), self.destination

    @property
    def current_en_mps(self) -> tuple[float, float]:
        """Of the water, towards east and north [m/s]."""
        return float(self.state[k.S_CURRENT_E]), float(self.state[k.S_CURRENT_N])

    def stopping_point(self) -> tuple[float, float]:
        """Return where the boat could come to rest: v² / 2a ahead, as the autopilot reckons."""
        s = self.state
        speed = math.hypot(s[k.S_VE], s[k.S_VN])
        reach_s = speed / (2.0 * self._settings[k.P_ACCEL])
        east, north = self.position
        return float(east + s[k.S_VE] * reach_s), float(north + s[k.S_VN] * reach_s)

    @property
    def apparent(self) -> tuple[float, float]:
        """Filtered apparent wind: (angle to the bow [rad, + starboard], speed [m/s])."""
        s = self.state
        return math.atan2(s[k.S_AWA_SIN], s[k.S_AWA_COS]), float(s[k.S_AWS])

    @property
    def true_wind(self) -> tuple[float, float]:
        """What WIND tells: (from [rad, 0..2π), speed [m/s])."""
        s = self.state
        return wrap_two_pi(math.atan2(s[k.S_TWD_SIN], s[k.S_TWD_COS])), float(s[k.S_TWS])


def _unit(east: float, north: float) -> tuple[float, float]:
    length = math.hypot(east, north)
    return (east / length, north / length) if length > 1e-9 else (0.0, 1.0)
