"""The autopilot's tuning by its logs: boats are simulated whose controller is known, and only their logs are told."""

import dataclasses
import math
import struct

import numpy as np
import pytest
from pymavlink.dialects.v20 import ardupilotmega as wire

from companion.boat import SteeringLog, steering_of
from companion.boat.steering import STEP_S
from companion.boat_logs import read_steering
from companion.cli import main
from companion.doctor import Level, examine_steering
from companion.mavlink.tlog import stamp

RIGHT_FF = 0.75  # of the boat below, at every speed above 1 m/s: the scale by speed sees to it
TUNED = {
    "ATC_STR_RAT_FF": RIGHT_FF,
    "ATC_STR_RAT_P": 0.2,
    "ATC_STR_RAT_I": 0.2,
    "ATC_STR_ANG_P": 2.0,
    "ATC_STR_RAT_MAX": 60.0,
    "MOT_SPD_SCA_BASE": 1.0,
    "WP_PIVOT_RATE": 60.0,
    "SAIL_HEEL_MAX": 30.0,
    "ATC_SAIL_P": 1.0,
}


def steered(*, minutes=5.0, speed_mps=1.5, helm=0.0, tau_s=0.3, lag_s=0.1, tack_s=45.0, seed=0, **parameters):
    """Return the log of a boat that tacks through 90 degrees every ``tack_s``, by a rate controller as ArduRover's.

    The bow's rate follows what the rudder gives with ``tau_s``, and the rudder what it is told by ``lag_s``; ``helm``
    is the rudder that it takes to hold her, to windward.
    """
    p, rng = TUNED | parameters, np.random.default_rng(seed)
    fine, n = 0.04, round(60.0 * minutes / 0.04)
    scale = min(1.0, p["MOT_SPD_SCA_BASE"] / speed_mps)
    gain = speed_mps / (RIGHT_FF * p["MOT_SPD_SCA_BASE"])  # radians a second with the rudder hard over
    bow, rate, integral, told = -0.8, 0.0, 0.0, [0.0] * max(1, round(lag_s / fine))
    rows = []
    for i in range(n):
        side = 1.0 if int(i * fine / tack_s) % 2 else -1.0  # of the course that is wanted
        off = side * math.radians(45.0) - bow
        most = math.radians(p["ATC_STR_RAT_MAX"])
        wanted = float(np.clip(p["ATC_STR_ANG_P"] * off, -most, most))
        error = wanted - rate
        if speed_mps > 1.0:
            integral = float(np.clip(integral + p["ATC_STR_RAT_I"] * error * fine, -1.0, 1.0))
        rudder = float(np.clip(p["ATC_STR_RAT_FF"] * wanted + p["ATC_STR_RAT_P"] * error + integral, -1.0, 1.0))
        told.append(rudder)
        servo = told.pop(0) * scale
        heel = math.radians(12.0) * math.copysign(1.0, bow)  # wind from north: to starboard with the bow there
        rate += fine / tau_s * (gain * servo - helm * gain * scale * math.copysign(1.0, bow) - rate)
        bow += fine * rate
        if i % round(STEP_S / fine) == 0:
            noise = math.radians(0.5) * rng.standard_normal()
            rows.append((i * fine, bow, rate + noise, wanted, side * math.radians(45.0), rudder, heel))
    t, bow, rate, wanted, course, rudder, heel = np.array(rows).T
    return SteeringLog(
        name="steered",
        t_s=t,
        heading_rad=bow,
        rate_radps=rate,
        wanted_rate_radps=wanted,
        wanted_heading_rad=course,
        rudder=rudder,
        ahead_mps=np.full(t.shape, speed_mps),
        heel_rad=heel,
        is_steered=np.ones(t.shape, dtype=np.bool_),
        tacks_s=tuple(np.arange(tack_s, 60.0 * minutes - tack_s, tack_s).tolist()),
        time_outs=0,
        parameters=p,
    )


def said(*logs):
    """Return the findings on a boat's logs by their code."""
    return {f.code: f for f in examine_steering(steering_of(logs))}


def test_a_boat_that_is_tuned_has_nothing_to_change():
    found = said(steered())
    assert all(f.wanted is None and f.level is Level.INFO for f in found.values())
    steering = steering_of([steered()])
    (band,) = steering.bands
    assert (band.low_mps, band.high_mps) == (1.0, 2.0)
    assert steering.overshoot_rad < math.radians(6.0)
    assert 1.0 < steering.tack_s < 4.0
    assert band.swing_hz is None


@pytest.mark.parametrize(("share", "wanted"), [(0.5, 0.4875), (0.7, 0.68), (1.8, 0.945)])
def test_ff_is_measured_and_moved_by_thirty_percent_at_most(share, wanted):
    now = share * RIGHT_FF
    band = steering_of([steered(ATC_STR_RAT_FF=now)]).bands[0]
    assert band.ff == pytest.approx(RIGHT_FF, rel=0.15)
    finding = said(steered(ATC_STR_RAT_FF=now))["tuning FF"]
    assert finding.level is Level.WARNING
    assert finding.wanted == pytest.approx(wanted, rel=0.15)
    assert 0.7 * now - 1e-3 <= finding.wanted <= 1.3 * now + 1e-3


def test_bands_of_speed_are_told_apart():
    steering = steering_of([steered(speed_mps=1.5), steered(speed_mps=2.5, seed=1), steered(speed_mps=0.6, seed=2)])
    assert [b.low_mps for b in steering.bands] == [0.3, 1.0, 2.0]
    assert all(b.ff == pytest.approx(RIGHT_FF, rel=0.2) for b in steering.bands[1:])
    # Below 1 m/s nothing is scaled, and the slow water turns her less: that is said.
    assert steering.bands[0].ff > 1.4 * RIGHT_FF
    assert "0.3 to 1 m/s" in examine_steering(steering)[0].what
    assert any(f.code == "tuning scale" for f in examine_steering(steering))


def test_a_controller_that_swings_is_told_and_its_p_is_to_be_less():
    wild = steered(ATC_STR_RAT_P=2.5, lag_s=0.4)
    band = steering_of([wild]).bands[0]
    assert 0.1 <= band.swing_hz <= 1.0
    assert band.swing_rad > math.radians(2.0)
    assert said(steered(lag_s=1.2))["tuning P"].parameter == "ATC_STR_RAT_P"  # on no course at all
    found = said(wild)
    assert found["tuning P"].wanted == pytest.approx(0.7 * 2.5)


def test_one_group_at_a_time_is_proposed():
    """While she swings nothing else can be judged; else FF first: what the others do depends on it."""
    found = said(steered(ATC_STR_RAT_FF=0.35, ATC_STR_RAT_P=2.5, lag_s=0.4))
    assert found["tuning P"].wanted is not None
    assert sum(f.wanted is not None for f in found.values()) == 1
    found = said(dataclasses.replace(steered(ATC_STR_RAT_FF=0.35), time_outs=3))
    assert found["tuning FF"].wanted is not None
    assert found["tuning tacks"].wanted is None
    assert "after the next log" in found["tuning tacks"].why
    assert sum(f.wanted is not None for f in found.values()) == 1


def test_a_rudder_that_reverses_all_the_time_is_told():
    log = steered()
    nervous = log.rudder + 0.1 * np.sign(np.sin(2.0 * math.pi * log.t_s / 1.7))
    finding = said(dataclasses.replace(log, rudder=nervous))["tuning P"]
    assert "reverses" in finding.what
    assert finding.wanted == pytest.approx(0.14)


def test_an_error_on_both_tacks_is_the_integrators_where_it_builds_and_the_rigs_where_it_does_not():
    none = said(steered(helm=0.3, ATC_STR_RAT_I=0.0))["tuning I"]
    assert "to windward" in none.what  # of no share of nothing is a step made
    assert none.wanted is None
    some = said(steered(helm=0.3, ATC_STR_RAT_I=0.01))["tuning I"]
    assert some.wanted == pytest.approx(0.013)
    slow = said(steered(helm=0.3, speed_mps=0.6))["tuning I"]
    assert slow.wanted is None
    assert "does not build" in slow.why
    assert "tuning I" not in said(steered(helm=0.3, ATC_STR_RAT_I=0.5))


def test_overshoot_saturation_and_a_late_rate_are_told():
    late = steered(lag_s=0.6, ATC_STR_ANG_P=1.5, ATC_STR_RAT_P=0.0)
    found = said(late)
    assert steering_of([late]).bands[0].lag_s == pytest.approx(0.6 + 0.3, abs=0.3)
    assert steering_of([late]).overshoot_rad > math.radians(15.0)
    assert found["tuning angle"].parameter == "ATC_STR_ANG_P"
    assert "tuning lag" in said(steered(lag_s=1.2, ATC_STR_ANG_P=0.7))
    hard = said(steered(ATC_STR_RAT_MAX=400.0, ATC_STR_ANG_P=20.0, tack_s=8.0, minutes=4.0))
    assert hard["tuning rate"].parameter == "ATC_STR_RAT_MAX"


def test_time_outs_of_tacks_heel_and_going_astern_are_told():
    log = steered()
    astern = np.where(np.arange(log.t_s.shape[0]) % 20 == 0, -0.2, log.ahead_mps)
    steering = steering_of([dataclasses.replace(log, time_outs=3, ahead_mps=astern, heel_rad=3.0 * log.heel_rad)])
    found = {f.code: f for f in examine_steering(steering)}
    assert found["tuning tacks"].wanted == pytest.approx(48.0)
    assert "3 of 5 tacks were given up" in found["tuning tacks"].what
    assert "5 % of the time" in found["tuning astern"].what
    assert found["tuning heel"].wanted is None  # the tacks first
    assert "after the next log" in found["tuning heel"].why


def test_what_the_autopilot_has_now_counts_before_what_the_log_says():
    steering = steering_of([steered(ATC_STR_RAT_FF=0.35)])
    mended = {f.code: f for f in examine_steering(steering, TUNED)}
    assert mended["tuning FF"].wanted is None
    assert mended["tuning FF"].value == RIGHT_FF


def test_where_nothing_was_turned_it_is_said():
    finding, sails = examine_steering(steering_of([steered(tack_s=1e9, minutes=3.0)]))
    assert (sails.code, sails.level, sails.wanted) == ("tuning sails", Level.INFO, None)
    assert "one trim" in sails.why
    assert "too few turns" in finding.what


# ----------------------------------------------------------------------------------- from files
def begun_at(log):
    return {round(at / STEP_S) for at in log.tacks_s}


def far(_i):
    return 200


def tlog(path, log, mode=10, system=1, jump_s=0.0, *, wp_m=far):
    out = b""
    mav, begun = wire.MAVLink(None, srcSystem=system, srcComponent=1), begun_at(log)
    for i, t_s in enumerate(log.t_s.tolist()):
        us, boot = int(1e6 * (1.75e9 + t_s + (jump_s if 2 * i > log.t_s.size else 0.0))), int(1000.0 * t_s)
        v, bow = log.ahead_mps[i], log.heading_rad[i]
        scaled = log.rudder[i] * min(1.0, log.parameters["MOT_SPD_SCA_BASE"] / v)
        pwm = [0] * 8
        pwm[2] = round(1500 - 300 * scaled)  # on the third servo, turned round
        messages = [
            mav.attitude_encode(boot, log.heel_rad[i], 0, bow, 0, 0, log.rate_radps[i]),
            mav.global_position_int_encode(
                boot, 0, 0, 0, 0, round(100 * v * math.cos(bow)), round(100 * v * math.sin(bow)), 0, 0
            ),
            mav.servo_output_raw_encode(us & 0xFFFFFFFF, 0, *pwm),
        ]
        if i % 5 == 0:
            messages.append(mav.heartbeat_encode(11, 3, 0x80, mode, 4))
            messages.append(
                mav.nav_controller_output_encode(
                    0, 0, round(math.degrees(log.wanted_heading_rad[i])), 0, wp_m(i), 0, 0, 0
                )
            )
        if i in begun:
            messages.append(mav.statustext_encode(6, b"Sailboat: Tacking"))
        if i == 0:
            more = {"SERVO3_FUNCTION": 26.0, "SERVO3_REVERSED": 1.0, "SERVO3_MIN": 1200.0, "SERVO3_MAX": 1800.0}
            more["SERVO3_TRIM"] = 1500.0
            for name, value in {**log.parameters, **more}.items():
                messages.append(mav.param_value_encode(name.encode(), value, 9, 100, 65535))
        for message in messages:
            out += stamp(us, message.pack(mav))
    path.write_bytes(out)
    return path


def bin_log(path, log, *, wp_m=far):
    formats = {
        "ATT": (131, "Qff", "TimeUS,Roll,Yaw"),
        "XKF1": (132, "QBff", "TimeUS,C,VN,VE"),
        "STER": (133, "Qfff", "TimeUS,SteerOut,DesTurnRate,TurnRate"),
        "NTUN": (134, "Qff", "TimeUS,DesYaw,WpDist"),
        "PARM": (135, "QNf", "TimeUS,Name,Value"),
        "MSG": (136, "QZ", "TimeUS,Message"),
        "MODE": (137, "QMB", "TimeUS,Mode,ModeNum"),
    }
    codes = {"Q": "Q", "f": "f", "B": "B", "N": "16s", "Z": "64s", "M": "B"}
    packing = {n: "<" + "".join(codes[c] for c in f) for n, (_, f, _) in formats.items()}
    fmt = struct.Struct("<BB4s16s64s")
    out = bytes([0xA3, 0x95, 128]) + fmt.pack(128, 89, b"FMT", b"BBnNZ", b"Type,Length,Name,Format,Columns")
    for name, (number, form, columns) in formats.items():
        length = 3 + struct.calcsize(packing[name])
        out += bytes([0xA3, 0x95, 128]) + fmt.pack(number, length, name.encode(), form.encode(), columns.encode())

    def say(name, t_s, *values):
        nonlocal out
        out += bytes([0xA3, 0x95, formats[name][0]]) + struct.pack(packing[name], int(1e6 * (60.0 + t_s)), *values)

    for name, value in log.parameters.items():
        say("PARM", 0.0, name.encode(), value)
    say("MODE", 0.0, 10, 10)
    degrees, begun = np.degrees, begun_at(log)
    for i, t_s in enumerate(log.t_s.tolist()):
        v, bow = log.ahead_mps[i], log.heading_rad[i]
        say("ATT", t_s, degrees(log.heel_rad[i]), degrees(bow) % 360.0)
        say("XKF1", t_s, 0, v * math.cos(bow), v * math.sin(bow))
        say("STER", t_s, 4500.0 * log.rudder[i], degrees(log.wanted_rate_radps[i]), degrees(log.rate_radps[i]))
        say("NTUN", t_s, degrees(log.wanted_heading_rad[i]), wp_m(i))
        if i in begun:
            say("MSG", t_s, b"Sailboat: Tacking")
    say("MSG", log.t_s[-1], b"Sailboat: Tacking timed out")
    path.write_bytes(out)
    return path


@pytest.mark.parametrize("write", [tlog, bin_log])
def test_both_kinds_of_log_tell_what_was_simulated(write, tmp_path):
    log = steered(ATC_STR_RAT_FF=0.5, helm=0.1, minutes=6.0)
    path = write(tmp_path / ("a.tlog" if write is tlog else "a.BIN"), log)
    (read,), skipped = read_steering([path])
    assert not skipped
    assert read.parameters["ATC_STR_RAT_FF"] == pytest.approx(0.5)
    assert read.tacks_s == pytest.approx([t + read.t_s[0] for t in log.tacks_s], abs=0.25)
    told, true = steering_of([read]).bands[0], steering_of([log]).bands[0]
    assert told.ff == pytest.approx(true.ff, rel=0.05)
    assert told.steady_error_rad == pytest.approx(true.steady_error_rad, abs=math.radians(0.7))
    assert steering_of([read]).tack_s == pytest.approx(steering_of([log]).tack_s, abs=0.5)
    if write is bin_log:
        assert read.time_outs == 1
        assert told.lag_s == pytest.approx(true.lag_s, abs=0.21)


@pytest.mark.parametrize("write", [tlog, bin_log])
def test_circles_of_a_loiter_are_no_turns_and_tell_nothing_of_the_helm(write, tmp_path):
    """Two holds of ten minutes were "204 degrees past the new course" and "0 of 17 tacks were given up"."""
    log = steered(ATC_STR_RAT_FF=0.5, helm=0.1, minutes=6.0)
    path = tmp_path / ("a.tlog" if write is tlog else "a.BIN")
    (read,), _ = read_steering([write(path, log, wp_m=lambda i: 3 + i % 3)])
    assert np.mean(read.is_steered) < 0.02
    assert (read.tacks_s, read.time_outs) == ((), 0)
    (leg,), _ = read_steering([write(path, log, wp_m=lambda i: 20 + i // 5 % 30)])  # a leg of 50 m after the other
    assert np.mean(leg.is_steered) > 0.98
    assert len(leg.tacks_s) == len(log.tacks_s)


def test_two_boats_in_one_recording_are_not_one_that_turns_about(tmp_path):
    log = steered(minutes=1.0)
    one, other = tlog(tmp_path / "a.tlog", log), tlog(tmp_path / "b.tlog", log, system=2)
    other.write_bytes(one.read_bytes() + other.read_bytes())
    read, (skipped,) = read_steering([one, other])
    assert len(read) == 1
    assert "two boats, systems 1 and 2" in skipped.why


def test_how_it_steered_is_told_by_the_autopilots_clock(tmp_path):
    """The logger's jumped in the middle of it: 40 minutes of nothing were steered in."""
    log = steered(ATC_STR_RAT_FF=0.5, minutes=6.0)
    (plain, jumped), _ = read_steering([tlog(tmp_path / "a.tlog", log), tlog(tmp_path / "b.tlog", log, jump_s=2400.0)])
    assert jumped.t_s.size == plain.t_s.size
    assert steering_of([jumped]).bands[0].ff == pytest.approx(steering_of([plain]).bands[0].ff, rel=0.02)


def test_hands_on_the_tiller_are_not_the_autopilots(tmp_path):
    log = dataclasses.replace(steered(minutes=2.0), tacks_s=())
    (read,), _ = read_steering([tlog(tmp_path / "a.tlog", log)])
    assert read.is_steered.all()
    (by_hand,), _ = read_steering([tlog(tmp_path / "b.tlog", log, mode=0)])
    assert not by_hand.is_steered.any()
    assert not steering_of([by_hand]).bands


def test_the_command_tells_a_step_and_sets_nothing(tmp_path, capsys):
    log = bin_log(tmp_path / "a.BIN", steered(ATC_STR_RAT_FF=0.4, minutes=5.0))
    (tmp_path / "notes.csv").write_text("t_s,heading_deg\n1,2\n")
    assert main(["doctor", "--log", str(tmp_path)]) == 0
    out = capsys.readouterr()
    assert "ATC_STR_RAT_FF" in out.out
    assert "set ATC_STR_RAT_FF 0.52 (now 0.4)" in out.out
    assert "nothing was changed" in out.out
    assert "notes.csv: only .BIN and .tlog" in out.err
    assert main(["doctor", "--log", str(log), "--apply"]) == 2
    assert main(["doctor"]) == 2
    assert main(["doctor", "--log", str(tmp_path / "notes.csv")]) == 1
