"""What is believed without a key: boot times that fit our clock, numbers in step, two heartbeats, three fixes."""

import random

import pytest
from pymavlink.dialects.v20 import ardupilotmega as wire

from companion.mavlink.reception import BEHIND_S, CONTEST_OVER_S, SWITCH_S, BootClock, LinkStats, PlausibilityFilter
from companion.mavlink.wire.assembler import VehicleAssembler
from companion.mavlink.wire.frames import Codec, Drop
from companion.messages import Mode, VehicleState

STEP_S = 0.05
ZERO_S = 1000.0  # our clock when the autopilot booted


def attitude(boot_s):
    return wire.MAVLink_attitude_message(round(boot_s * 1e3) % 2**32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0)


def beat(mode=10, armed=True):
    return wire.MAVLink_heartbeat_message(11, 3, 128 if armed else 0, mode, 4, 3)


def wind():
    return wire.MAVLink_wind_message(90.0, 5.0, 0.0)


def fix(boot_s, north_m=0.0):
    lat = round((51.0 + north_m / 111_195.0) * 1e7)
    return wire.MAVLink_global_position_int_message(round(boot_s * 1e3), lat, 10_000_000, 0, 0, 0, 0, 0, 9000)


class Air:
    """A true autopilot that says ATTITUDE, WIND, ATTITUDE ... every 50 ms, and whoever else writes to the link."""

    def __init__(self):
        self.witness, self.true, self.reader = PlausibilityFilter(), Codec(1, 1), Codec(9, 9)
        self.t_s, self.count = ZERO_S + 50.0, 0
        self.dropped = 0

    def hear(self, codec, message):
        [heard] = self.reader.feed(codec.pack(message))
        return self.witness.objection(self.t_s, heard)

    def run(self, seconds, *, boot_zero_s=ZERO_S, loss=0.0, rng=None):
        """Let the true one speak; every message of it is believed."""
        bad = []
        for _ in range(round(seconds / STEP_S)):
            self.t_s += STEP_S
            self.count += 1
            message = wind() if self.count % 2 else attitude(self.t_s - boot_zero_s)
            if rng is not None and rng.random() < loss:
                self.true.pack(message)
                self.dropped += 1
                continue
            objection = self.hear(self.true, message)
            if objection is not None:
                bad.append((self.t_s, objection))
        return bad


def test_an_honest_autopilot_is_always_believed():
    assert Air().run(60.0) == []


@pytest.mark.parametrize("loss", [0.1, 0.3, 0.6])
def test_a_bad_link_costs_hardly_more(loss):
    air = Air()
    refused = air.run(600.0, loss=loss, rng=random.Random(loss))
    assert air.dropped > 1000
    assert len(refused) <= 0.005 * air.count


@pytest.mark.parametrize("gap_s", [0.7, 1.2, 3.0, 30.0, 600.0])
def test_a_gap_is_bridged_at_once(gap_s):
    air = Air()
    air.run(20.0)
    for _ in range(round(gap_s / STEP_S)):  # the autopilot goes on talking to nobody
        air.true.pack(wind())
    air.t_s += gap_s
    assert air.run(20.0) == []


def test_fixes_ahead_in_boot_time_are_not_used_and_evict_none():
    air = Air()
    air.run(10.0)
    forger = Codec(1, 1)
    for _ in range(100):
        assert air.hear(forger, attitude(air.t_s - ZERO_S + 4.5)) is Drop.WRONG_CLOCK
        assert air.run(0.2) == []


def test_what_is_out_of_step_is_not_used_while_the_true_one_speaks():
    air = Air()
    air.run(10.0)
    forger, believed = Codec(1, 1), 0
    for number in range(200):
        believed += air.hear(forger, beat(mode=4)) is None
        bad = air.run(0.5)
        assert len(bad) <= 1, number
    assert believed <= 8, "one number in a hundred is in step by chance"


@pytest.mark.parametrize("silent_s", [0.8, 2.0, 30.0, 600.0])
def test_a_route_that_fell_silent_vouches_for_nobody_while_the_other_speaks(silent_s):
    """A stream that was vouched for once and then died held every number for ever: each forged HOLD was believed by it.

    A hurried simulation made such a second stream in its first seconds; a route that goes, or a gap, does so on a boat.
    """
    air = Air()
    air.run(10.0)
    second = Codec(1, 1)
    for _ in range(20):  # the same autopilot over another route, with a count of its own
        air.run(0.2)
        air.hear(second, attitude(air.t_s - ZERO_S))
        air.hear(second, wind())
    assert air.run(silent_s) == []
    forger, believed = Codec(1, 1), 0
    for _ in range(200):
        believed += air.hear(forger, beat(mode=4)) is None
        air.run(0.2)
    assert believed <= 8, "one number in a hundred is in step by chance"


def test_a_flood_of_every_number_does_not_lead_the_count_away():
    air = Air()
    air.run(10.0)
    forger, believed = Codec(1, 1), 0
    for _ in range(100):
        believed += [air.hear(forger, beat(mode=4)) for _ in range(34)].count(None)
        assert len(air.run(0.2)) <= 1
    assert believed <= 0.03 * 3400


def test_a_forger_who_keeps_count_for_himself_is_not_believed_for_it():
    air = Air()
    air.run(10.0)
    forger = Codec(1, 1)
    forger._mav.seq = (air.true._mav.seq + 128) % 256
    believed = [air.hear(forger, beat(mode=4)) for _ in range(20) if air.run(0.05) == []].count(None)
    assert believed == 0


def test_a_reboot_is_believed_within_two_seconds():
    air = Air()
    air.run(20.0)
    air.true = Codec(1, 1)
    air.t_s += 2.0
    bad = air.run(10.0, boot_zero_s=air.t_s)
    assert bad
    assert all(reason is Drop.WRONG_CLOCK for _, reason in bad)
    assert bad[-1][0] - bad[0][0] <= SWITCH_S + 2 * STEP_S


@pytest.mark.parametrize("begins_late", [False, True])
@pytest.mark.parametrize(("lag_s", "period_s"), [(0.6, 2.0), (0.6, 10.0), (0.8, 60.0), (2.0, 10.0), (4.5, 60.0)])
def test_one_whose_messages_wait_now_and_then_is_heard_and_is_no_second_autopilot(lag_s, period_s, begins_late):
    clock, heard_s, unheard = BootClock(), 0.0, []
    for n in range(30_000):
        sent_s = 0.2 * n
        waits = int(sent_s / period_s) % 2 == (0 if begins_late else 1)
        heard_s = max(heard_s, sent_s + (lag_s if waits else 0.0))
        if not clock.take(heard_s, sent_s):
            unheard.append(sent_s)
        assert not clock.is_contested(heard_s)
    assert not unheard or begins_late
    assert all(period_s <= t <= period_s + SWITCH_S + lag_s for t in unheard)  # the first that did not wait, once


def test_all_is_believed_over_the_end_of_32_bits_of_boot_time():
    air = Air()
    zero_s = air.t_s + 30.0 - 2**32 / 1e3
    assert air.run(60.0, boot_zero_s=zero_s) == []
    assert not air.witness.clock.is_new


def test_a_second_route_without_the_delay_of_the_first_is_no_second_autopilot():
    clock = BootClock()
    for n in range(300):
        assert clock.take(0.2 * n, 0.2 * n - 2.0)
        clock.take(0.2 * n, 0.2 * n)
        assert not clock.is_contested(0.2 * n)


def test_a_clock_that_is_ahead_by_more_than_messages_wait_is_another():
    clock = BootClock()
    for n in range(100):
        assert clock.take(0.2 * n, 0.2 * n)
        assert not clock.take(0.2 * n, 0.2 * n + BEHIND_S + 1.0)
    assert clock.is_contested(20.0)


def test_two_autopilots_on_one_id_are_noticed_and_the_first_is_heard():
    air, other = Air(), Codec(1, 1)
    air.run(10.0)
    assert not air.witness.clock.is_contested(air.t_s)
    for _ in range(20):
        assert air.hear(other, attitude(air.t_s - ZERO_S + 5000.0)) is Drop.WRONG_CLOCK
        air.run(0.2)
    assert air.witness.clock.is_contested(air.t_s)
    air.run(CONTEST_OVER_S + 1.0)
    assert not air.witness.clock.is_contested(air.t_s)


def test_a_few_forged_clocks_are_no_second_autopilot():
    air, other = Air(), Codec(1, 1)
    air.run(10.0)
    for n in range(40):
        air.hear(other, attitude(air.t_s - ZERO_S + 300.0 * (n + 1)))
        air.run(0.5)
    assert not air.witness.clock.is_contested(air.t_s)


def test_two_routes_of_one_autopilot_are_both_heard():
    """A router that merges two ports of the autopilot brings two counts of one clock."""
    air, second, bad = Air(), Codec(1, 1), []
    second._mav.seq = 100
    air.run(10.0)
    for n in range(100):
        message = wind() if n % 2 else attitude(air.t_s - ZERO_S)
        if air.hear(second, message) is not None:
            bad.append(n)
        assert air.run(0.1) == []
    assert len(bad) <= 6
    assert not bad or bad[-1] < 12, "believed once its boot times were right"


def test_an_overtaken_frame_is_late_and_not_forged():
    air = Air()
    air.run(10.0)
    late = air.true.pack(attitude(air.t_s - ZERO_S))
    air.run(0.1)
    [heard] = air.reader.feed(late)
    assert air.witness.objection(air.t_s, heard) is None


# ------------------------------------------------------------------------------------------ the assembler
def heard(message):
    [out] = Codec(9, 9).feed(Codec(1, 1).pack(message))
    return out


def modes(*beats_s):
    """Return (t_s, mode) after each heartbeat or other message."""
    assembler, out = VehicleAssembler(), []
    for t_s, message in beats_s:
        assembler.take(t_s, heard(message))
        status = assembler.status
        out.append((status.mode, status.is_armed))
    return out


AUTO, HOLD = (Mode.AUTO, True), (Mode.HOLD, True)


def test_one_forged_heartbeat_changes_no_mode():
    assert modes((0, beat()), (1, beat()), (1.5, beat(4)), (2, beat()), (3, beat())) == [AUTO] * 5
    assert modes((0, beat()), (1, beat()), (1.5, beat(10, armed=False)), (2, beat())) == [AUTO] * 4


def test_a_true_change_is_a_fact_at_its_second_heartbeat():
    assert modes((0, beat()), (1, beat()), (1.2, beat(4)), (2.2, beat(4)), (3.2, beat(4))) == [AUTO] * 3 + [HOLD] * 2


def test_two_of_three_count_where_a_forger_says_the_old_mode():
    assert modes((0, beat()), (1, beat(4)), (1.5, beat()), (2, beat(4)))[-1] == HOLD


def test_a_change_that_was_acknowledged_is_a_fact_at_once_and_only_one():
    ack = wire.MAVLink_command_ack_message(wire.MAV_CMD_DO_SET_MODE, 0, 0, 0, 1, 191)
    assert modes((0, beat(4)), (1, beat(4)), (1.1, ack), (1.5, beat()), (1.6, beat(4)), (2.5, beat())) == [
        HOLD,
        HOLD,
        HOLD,
        AUTO,
        AUTO,
        AUTO,
    ]
    refused = wire.MAVLink_command_ack_message(wire.MAV_CMD_DO_SET_MODE, 4, 0, 0, 1, 191)
    assert modes((0, beat(4)), (1, beat(4)), (1.1, refused), (1.5, beat()))[-1] == HOLD


def test_after_a_silence_the_first_heartbeat_is_believed():
    assert modes((0, beat()), (1, beat()), (20, beat(4)))[-1] == HOLD


def places(*fixes):
    assembler, out = VehicleAssembler(), []
    for boot_s, north_m in fixes:
        [*values] = assembler.take(boot_s, heard(fix(boot_s, north_m)))
        out.append(bool(values) and isinstance(values[0], VehicleState))
    return out


def test_a_place_that_nothing_agrees_with_is_not_used():
    assert places((1.0, 0), (1.2, 0.5), (1.3, 300.0), (1.4, 1.0), (1.5, 300.0), (1.6, 1.5)) == [
        True,
        True,
        False,
        True,
        False,
        True,
    ]


def test_a_jump_that_stays_is_believed_at_the_third_fix():
    assert places((1.0, 0), (1.2, 0), (1.4, 40.0), (1.6, 40.2), (1.8, 40.4), (2.0, 40.6)) == [
        True,
        True,
        False,
        False,
        True,
        True,
    ]
    assert places((1.0, 0), (2.0, 0), (3.0, 40.0), (5.0, 40.2)) == [True, True, False, True]


def test_after_a_silence_any_place_is_possible():
    assert places((1.0, 0), (20.0, 500.0)) == [True, True]


def test_the_loss_is_that_of_the_vehicles_own_frames():
    """Another boat on the same radio is counted as heard, and what is lost of it is not."""
    stats = LinkStats()
    for seq in range(0, 1000, 2):
        stats.frames_in += 1
        stats.count(1, 1, seq % 256)
    assert stats.loss() == pytest.approx(0.5, abs=0.01)
    stats.frames_in += 9000
    assert stats.loss() == pytest.approx(0.5, abs=0.01)
