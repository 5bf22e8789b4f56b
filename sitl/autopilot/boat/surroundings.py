"""What is about a boat that is not the plan's, brought into the compiled loop's state ten times a second."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from companion.boat.boat import coefficient_of
from companion.geo.shift import Shift
from sitl.autopilot.boat import kernel as k
from sitl.autopilot.boat.scalars import hash01
from sitl.autopilot.departures import Departures
from sitl.world import Process, Waters, Wind

_STEP_S = 0.1
_GPS_STREAMS = (11, 12)   # of the seed: east, north
_TACKS = 0x7AC4           # what tells the lots of tacks from a faulty vane's


class Surroundings:
    """Waters and departures of one boat. Times are since her start, places metres from her home."""

    def __init__(self, wind: Wind, departures: Departures | None, waters: Waters | None, seed: int) -> None:
        self._wind, self._waters = wind, waters
        self._home: Shift | None = None   # from her metres to those that the waters are in, where they are others
        self.departures = departures or Departures()
        self._seed = seed
        sensors = self.departures.sensors
        self._gps = [Process(1.0 / sensors.gps_noise_s, _STEP_S, seed, stream, from_mean=True)
                     for stream in _GPS_STREAMS] if sensors.gps_noise_m > 0.0 else []

    def carry(self, shift: Shift) -> None:
        """Take it that her metres count from elsewhere."""
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
        """Return the wind where she is: from [rad], speed [m/s]."""
        return self._wind.at(t_s) if self._waters is None else self._waters.wind_at(t_s, self._place(state))

    def look(
        self, t_s: float, state: NDArray[np.float64], tide_en_mps: tuple[float, float],
        jump_en_m: tuple[float, float], fault_rad: float,
    ) -> None:
        """Set what changes: stream, waves, what her position and her compass err by, the next tack's lot.

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
