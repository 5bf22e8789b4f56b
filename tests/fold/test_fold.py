"""The fold and what it must not believe: parameters, faults of its own, and who may tell it anything."""

from __future__ import annotations

import asyncio
import math
import socket
from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pymavlink.dialects.v20 import ardupilotmega as wire

from companion.boat import Afloat, AutopilotLimits, LearnedAfloat, as_learned, mark_of
from companion.boat.afloat import Told
from companion.clock import run
from companion.compose import config_of, estimator_of, voyage_of
from companion.current.estimator import SCALE_SD, CurrentEstimator
from companion.eta import Pace
from companion.field.guidance import LastResort
from companion.fold import VoyageFold
from companion.geofence import load_mission
from companion.mavlink.autopilot import Autopilot
from companion.mavlink.link import Link
from companion.mavlink.transports import open_link
from companion.mavlink.wire.frames import Codec
from companion.mavlink.wire.parameter_ranges import RANGES, believable, effect_of, refusal
from companion.messages import GeoPoint, VehicleState, WindQuality, WindSample, WindSource
from companion.skipper import Skipper
from companion.skipper.step.config import Learning, Permissions
from companion.skipper.step.snapshot import Disbelieved, ParameterChanged, WindHealth
from companion.wind import WindTracker
from companion.wind.parameters import VaneParameters
from sitl.autopilot import AutopilotConfig, SimulatedAutopilot, serve
from sitl.world.environment import Constant
from tests.skipper.world import with_parts

DEMO = "missions/archipelago.toml"


def fresh():
    mission = load_mission(DEMO)
    return VoyageFold(
        Skipper(voyage=voyage_of(mission), config=config_of(mission)),
        WindTracker(estimator=estimator_of(mission)),
        Permissions(),
    )


def told(fold, name, value, *, component=1, t_s=1.0, index=65535):
    message = wire.MAVLink_param_value_message(name.encode(), value, 9, 900, index)
    [heard] = Codec(9, 9).feed(Codec(1, component).pack(message))
    fold.message(t_s, heard)


def disbelieved(fold, t_s=2.0):
    return [e for e in fold.tick(t_s).snapshot.events if isinstance(e, Disbelieved)]


@settings(max_examples=60)
@given(st.dictionaries(st.sampled_from(sorted(RANGES)), st.floats(width=32)))
def test_no_value_of_a_parameter_raises_and_the_limits_are_learnt(values):
    good, refused = believable(values)
    assert len(good) + len(refused) == len(values)
    limits = AutopilotLimits.from_params(good)
    assert math.isfinite(limits.sail_no_go_angle_rad)
    assert math.isfinite(VaneParameters.from_mapping(good).true_tau_s)


def test_the_defaults_stand_in_for_what_cannot_be():
    fold = fresh()
    for name in RANGES:
        told(fold, name, math.nan)
    assert not fold.unread, "answered, if with nonsense"
    assert len(disbelieved(fold)) == len(RANGES)
    assert fold.tick(3.0).snapshot.limits == AutopilotLimits()
    for name in RANGES:
        told(fold, name, math.nan)
    assert not disbelieved(fold, 4.0), "once"


def test_an_impossible_value_leaves_the_known_one():
    fold = fresh()
    for name, value in (("SAIL_NO_GO_ANGLE", 40.0), ("SAIL_XTRACK_MAX", 7.0), ("WP_RADIUS", 3.0)):
        told(fold, name, value)
    told(fold, "SAIL_NO_GO_ANGLE", 90.0)
    limits = fold.tick(2.0).snapshot.limits
    assert math.degrees(limits.sail_no_go_angle_rad) == pytest.approx(40.0)
    assert limits.sail_xtrack_max_m == 7.0


def test_a_change_is_believed_when_it_is_told_twice():
    fold = fresh()
    for name, value in (("SAIL_NO_GO_ANGLE", 40.0), ("SAIL_XTRACK_MAX", 7.0), ("WP_RADIUS", 3.0)):
        told(fold, name, value)
    told(fold, "SAIL_XTRACK_MAX", 100.0)
    assert "SAIL_XTRACK_MAX" in fold.unread
    assert fold.tick(2.0).snapshot.limits.sail_xtrack_max_m == 7.0
    told(fold, "SAIL_XTRACK_MAX", 7.0)
    assert "SAIL_XTRACK_MAX" not in fold.unread
    told(fold, "SAIL_XTRACK_MAX", 100.0)
    told(fold, "SAIL_XTRACK_MAX", 100.0)
    assert fold.tick(3.0).snapshot.limits.sail_xtrack_max_m == 100.0


def changed(fold, t_s=2.0):
    return [e for e in fold.tick(t_s).snapshot.events if isinstance(e, ParameterChanged)]


def heard(fold, first_s, last_s, *, twd_rad=0.3):
    """Let the fold hear a wind and a boat that lies still, once a second; return the last snapshot."""
    here = GeoPoint(lat_deg=50.817, lon_deg=-1.31)
    for t in range(first_s, last_s):
        fold.take(
            VehicleState(t_s=float(t), boot_s=float(t), position=here, velocity_en_mps=(0.0, 0.0), heading_rad=1.0)
        )
        fold.take(
            WindSample(
                t_s=float(t),
                twd_from_rad=twd_rad,
                tws_mps=5.0 + 0.01 * (t % 7),
                source=WindSource.AUTOPILOT_TRUE,
                quality=WindQuality.GOOD,
            )
        )
        snapshot = fold.tick(float(t)).snapshot
    return snapshot


@pytest.mark.parametrize("name", ["WNDVN_DIR_OFS", "AHRS_ORIENTATION", "COMPASS_ORIENT"])
def test_a_parameter_that_changes_what_a_sensor_says_is_said_and_the_wind_is_learned_anew(name):
    fold = fresh()
    told(fold, name, 0.0)
    before = heard(fold, 1, 60)
    assert before.wind.health is WindHealth.GOOD
    current = fold.current
    told(fold, name, 4.0)
    assert not changed(fold, 60.0), "told once"
    assert name in fold.unread, "asked for again"
    told(fold, name, 4.0)
    [event] = changed(fold, 61.0)
    assert event.text == (
        f"{name} was set from 0 to 4 ({effect_of(name).value}): wind, current and polar are learned anew"
    )
    after = heard(fold, 62, 70, twd_rad=1.9)
    assert name in after.unsure
    assert after.wind.record_s < 10.0
    assert after.wind.mean_twd_from_rad == pytest.approx(1.9, abs=0.01), "nothing is left of the wind before"
    assert fold.current is not current
    assert not heard(fold, 70, 140, twd_rad=1.9).unsure


def test_an_offset_that_was_set_leaves_the_wind_before_it_and_says_how_far_it_has_turned():
    fold = fresh()
    told(fold, "WNDVN_DIR_OFS", 0.0)
    assert heard(fold, 1, 60).wind_before is None
    for _ in range(2):
        told(fold, "WNDVN_DIR_OFS", 90.0)
    before = heard(fold, 60, 62).wind_before
    assert before.twd_from_rad == pytest.approx(0.3, abs=0.01)
    assert before.turned_rad == pytest.approx(math.radians(90.0))
    for _ in range(2):
        told(fold, "WNDVN_DIR_OFS", 0.0)
    assert heard(fold, 62, 64).wind_before.turned_rad == pytest.approx(0.0), "put back"
    assert heard(fold, 64, 140).wind_before is None, "believed again"
    for _ in range(2):
        told(fold, "COMPASS_ORIENT", 4.0)
    assert heard(fold, 140, 142).wind_before is None, "what another compass told of the wind is of no use"


@pytest.mark.parametrize(
    ("name", "anew"), [("SERVO1_REVERSED", True), ("SAIL_ANGLE_IDEAL", True), ("SAIL_HEEL_MAX", False)]
)
def test_one_that_changes_how_she_answers_leaves_the_wind(name, anew):
    fold = fresh()
    told(fold, name, 0.0)
    heard(fold, 1, 60)
    current = fold.current
    told(fold, name, 1.0)
    told(fold, name, 1.0)
    [event] = changed(fold, 60.0)
    assert ("anew" in event.text) is anew
    assert (fold.current is not current) is anew
    assert heard(fold, 61, 63).wind.record_s > 50.0


@pytest.mark.parametrize("error", [0.0, 0.35])
def test_what_her_file_says_of_her_speeds_is_what_the_current_reckons_with(error):
    fold = fresh()
    voyage = fold.skipper.voyage
    skipper = replace(fold.skipper, voyage=replace(voyage, boat=replace(voyage.boat, told_speed_error=error)))
    fold = VoyageFold(skipper, WindTracker(estimator=estimator_of(load_mission(DEMO))), Permissions())

    told(fold, "SERVO1_REVERSED", 0.0)
    heard(fold, 1, 60)
    first = fold.current
    for value in (0.0, 1.0, 1.0):  # the current is learned anew with the last
        told(fold, "SERVO1_REVERSED", value)
        fold.tick(60.0)
        assert math.sqrt(fold.current.doubt().covariance[2][2]) == pytest.approx(max(SCALE_SD, error), rel=0.01)
    assert fold.current is not first


@pytest.mark.parametrize("health", [WindHealth.GOOD, WindHealth.UNTRUSTED, WindHealth.NONE])
def test_a_boat_whose_vane_is_not_believed_is_held_against_her_motion_all_the_same(health):
    """Driven astern for 22 minutes while the vane stood still: nobody compared, for a wind that is not believed."""
    fold = fresh()
    seen = heard(fold, 1, 60)
    beat = wire.MAVLink_heartbeat_message(10, 3, 128 | 1, 10, 4, 3)  # a boat of ArduRover's, armed, in AUTO
    [frame] = Codec(9, 9).feed(Codec(1, 1).pack(beat))
    fold.message(60.0, frame)
    fold.tick(60.0)
    sailing = fold._sailing(60.0, replace(seen.wind, health=health))
    assert sailing.is_driven is (health is not WindHealth.NONE)
    assert sailing.is_heard is (health is not WindHealth.UNTRUSTED)


@pytest.mark.parametrize("is_engaged", [True, False])
def test_while_the_last_resort_steers_the_step_is_off_the_plan(is_engaged):
    fold = fresh()
    fold.state = with_parts(fold.state, by_field={"resort": LastResort(engaged=is_engaged)})
    assert fold.tick(1.0).is_off_plan is is_engaged


def test_a_filter_is_no_sensor_and_a_stranger_to_the_table_is_nobodys():
    fold = fresh()
    for name in ("WNDVN_TRUE_FILT", "LOG_BITMASK"):
        for value in (0.05, 0.5, 0.5):
            told(fold, name, value)
    assert [e.name for e in changed(fold)] == ["WNDVN_TRUE_FILT"]
    assert not fold.tick(3.0).snapshot.unsure


def test_one_that_was_not_known_is_said_when_it_is_set_under_way_and_not_when_a_list_is_read():
    fold = fresh()
    told(fold, "COMPASS_ORIENT", 6.0)
    assert not changed(fold), "before she sails somebody reads it"
    fold.state = with_parts(fold.state, voyage={"sailing": True})
    told(fold, "SERVO3_REVERSED", 1.0, index=311)
    assert "SERVO3_REVERSED" not in fold.unread
    told(fold, "AHRS_ORIENTATION", 8.0)
    assert fold.unread[-1] == "AHRS_ORIENTATION"
    told(fold, "AHRS_ORIENTATION", 8.0)
    [event] = changed(fold, 3.0)
    assert event.text.startswith("AHRS_ORIENTATION was set from a value that was not known to 8")


def test_parameters_and_versions_of_other_components_are_none():
    fold = fresh()
    told(fold, "FRAME_CLASS", 2.0, component=154)
    version = wire.MAVLink_autopilot_version_message(0, 0, 0, 0, 0, [0] * 8, [0] * 8, [0] * 8, 0, 0, 0, [5] * 18)
    [heard] = Codec(9, 9).feed(Codec(1, 154).pack(version))
    fold.message(1.0, heard)
    identity = fold.tick(2.0).snapshot.identity
    assert identity.frame_class is None
    assert identity.uid is None


def version(fold, number, *, component=1):
    message = wire.MAVLink_autopilot_version_message(0, number, 0, 0, 0, [0] * 8, [0] * 8, [0] * 8, 0, 0, 0, [5] * 18)
    [heard] = Codec(9, 9).feed(Codec(1, component).pack(message))
    fold.message(1.0, heard)


@pytest.mark.parametrize(
    ("number", "is_old"), [(0x04020300, True), (0x04030000, False), (0x04070000, False), (0, False)]
)
def test_an_autopilot_that_steers_by_l1_is_asked_for_its_parameters_and_no_other_believed_in_them(number, is_old):
    fold = fresh()
    for name, value in {"SAIL_NO_GO_ANGLE": 45.0, "SAIL_XTRACK_MAX": 10.0, "WP_RADIUS": 3.0}.items():
        told(fold, name, value)
    version(fold, number)
    assert ({"NAVL1_PERIOD", "NAVL1_DAMPING"} <= set(fold.unread)) is is_old
    told(fold, "NAVL1_DAMPING", 0.0)
    told(fold, "NAVL1_PERIOD", 11.0)
    limits = fold.tick(2.0).snapshot.limits
    assert (limits.l1_period_s, limits.l1_damping) == ((11.0, 0.75) if is_old else (0.0, 0.75))
    assert not {"NAVL1_PERIOD", "NAVL1_DAMPING"} & set(fold.unread)


def test_a_fault_of_its_own_is_said_once_and_ends_nothing(monkeypatch):
    fold = fresh()

    def broken(*_):
        raise ZeroDivisionError("of all things")

    monkeypatch.setattr(WindTracker, "set_parameters", broken)
    for n in range(3):
        told(fold, "WNDVN_TYPE", 10.0 + n)
    [said] = disbelieved(fold)
    assert "of all things" in said.text
    told(fold, "WP_RADIUS", 3.0)
    assert "WP_RADIUS" not in fold.unread


def test_refusals_name_the_value_and_what_can_be():
    assert refusal("SAIL_NO_GO_ANGLE", 89.0) == ""
    assert refusal("ANY_OTHER", math.inf) == ""
    assert refusal("WP_RADIUS", -1.0) == "WP_RADIUS -1 cannot be (0 to 10000)"


def test_over_tcp_an_impossible_parameter_costs_no_connection():
    """It hung up thirteen times: what a subscriber raised reached the transport, which hung up."""
    fold = fresh()

    async def main():
        with socket.socket() as probe:
            probe.bind(("127.0.0.1", 0))
            port = probe.getsockname()[1]
        boat = SimulatedAutopilot(
            AutopilotConfig(is_warm=True, parameters={"SAIL_NO_GO_ANGLE": 90.0}), Constant(0.0, 5.0), 1
        )
        async with (
            serve(boat, [f"tcpin:127.0.0.1:{port}"]),
            Link(open_link(f"tcp:127.0.0.1:{port}"), objection=fold.objection) as link,
        ):
            link.subscribe(fold.message)
            await link.wait_autopilot(20.0)
            autopilot = Autopilot(link)
            for name in ("SAIL_NO_GO_ANGLE", "SAIL_XTRACK_MAX", "WP_RADIUS", "SAIL_NO_GO_ANGLE"):
                assert (await autopilot.get_parameter(name)).is_ok
            await asyncio.sleep(0.1)
            return link.transport.stats.connections, link.stats.faults

    connections, faults = run(main(), speedup=8.0)
    assert connections == 1
    assert not faults
    assert fold.tick(1e6).snapshot.limits == AutopilotLimits(sail_xtrack_max_m=10.0, wp_radius_m=3.0)


def test_once_plans_are_of_the_learned_boat_so_is_the_rest_and_the_pace_begins_anew():
    fold = fresh()
    paced_before = Pace(tries=5.0, prior=0.0, took_s=100.0, made_s=70.0)
    told = Told(x=(-0.3, 0.0, 0.0, 0.0))
    boat = fold.skipper.voyage.boat
    known = LearnedAfloat(of=mark_of(boat), told=told, sailed_s=4000.0, file_error=2.0, own_error=1.0)
    for is_used in (False, True):
        fold._pace = paced_before
        fold.state = replace(fold.state, afloat=Afloat.of(replace(known, is_used=is_used)))
        step = fold.tick(1.0)
        assert step.voyage.boat == (as_learned(boat, told) if is_used else boat)
        assert step.pace.share == pytest.approx(0.7)
    skipper_step = Skipper.step

    def begins(skipper, state, snapshot):
        state, actions = skipper_step(skipper, state, snapshot)
        return replace(state, afloat=Afloat.of(replace(known, is_used=True))), actions

    fold.state = replace(fold.state, afloat=Afloat.of(known))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Skipper, "step", begins)
        assert fold.tick(2.0).pace.tries == 0.0


@pytest.mark.parametrize("word", ["use", "shadow", "off"])
def test_a_mission_says_whether_the_boat_is_learned(tmp_path, word):
    path = tmp_path / "m.toml"
    path.write_text(f'[[goal]]\nlat = 50.83\nlon = -1.3\n[boat]\nlearn = "{word}"\n', encoding="utf-8")
    assert config_of(load_mission(path)).learn is Learning(word)
    assert config_of(load_mission(DEMO)).learn is Learning.USE


def test_an_offset_that_we_wrote_is_no_vane_that_was_turned_and_what_was_told_of_the_vane_begins_anew():
    """The wind before it was told by a turned vane: by that, sea room was sought from a wind that never blew."""
    fold = fresh()
    told(fold, "WNDVN_DIR_OFS", 0.0)
    before = heard(fold, 1, 60)
    assert before.vane is not None
    assert before.vane_offset_rad is None, "not said of which type the vane is: ArduPilot adds it to types 3 and 4"
    told(fold, "WNDVN_TYPE", 4.0, index=12)
    assert heard(fold, 60, 61).vane_offset_rad == 0.0
    fold.state = replace(fold.state, vane=replace(fold.state.vane, written_deg=90.0))
    vane = fold.vane
    for _ in range(2):
        told(fold, "WNDVN_DIR_OFS", 90.0)
    after = heard(fold, 60, 62)
    assert after.vane_offset_rad == pytest.approx(math.radians(90.0))
    assert after.wind_before is None
    assert "WNDVN_DIR_OFS" in after.unsure
    assert fold.vane is not vane
    for _ in range(2):
        told(fold, "WNDVN_DIR_OFS", 0.0)
    heard(fold, 62, 140)
    for _ in range(2):
        told(fold, "WNDVN_DIR_OFS", 30.0)
    assert heard(fold, 140, 142).wind_before.turned_rad == pytest.approx(math.radians(30.0)), "somebody else's is"


def test_the_vane_is_held_against_how_she_sails_and_anew_once_when_the_direction_leaps(monkeypatch):
    fold, taken, forgotten = fresh(), [], []
    monkeypatch.setattr(fold.vane, "update", lambda now, current_en_mps: taken.append(now.t_s))
    monkeypatch.setattr(fold.vane, "forget", lambda: forgotten.append(True))
    heard(fold, 1, 20)
    assert taken == [float(t) for t in range(1, 20)]
    assert not forgotten
    monkeypatch.setattr(CurrentEstimator, "wind_before_rad", property(lambda _: 1.0))
    heard(fold, 20, 30)
    assert forgotten == [True]
