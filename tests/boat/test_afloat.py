"""The boat learned under way: from stretches of steady sailing alone, slowly, within bounds, used when it is better."""

import json
import math
from dataclasses import replace

import numpy as np
import pytest

from companion.boat import Boat, ardurover_sitl
from companion.boat.afloat import (
    BETTER,
    BIN,
    FASTEST,
    LEAST_MANOEUVRES,
    PROOF_S,
    REOPEN,
    STEPS,
    TAKEN_BACK_S,
    TOLD_EVERY_S,
    WAITING,
    Afloat,
    LearnedAfloat,
    Look,
    Stretch,
    Told,
    _learned,
    as_learned,
    factor,
    followed,
    mark_of,
)
from companion.boat.log import Why

BOAT = Boat(polar=ardurover_sitl(), speed_error=0.3, tack_loss_s=4.0)
FILE = LearnedAfloat(of=mark_of(BOAT))


def looks(seconds, *, share=1.0, seed=0, board_s=120.0, twa_deg=(55.0, 90.0, 130.0), stops=1.0, tow_mps=None):
    """Yield the looks at a boat that sails boards of each angle in turn, at a share of her file's speed."""
    rng = np.random.default_rng(seed)
    heading, speed, here, gust = math.radians(twa_deg[0]), 0.0, np.zeros(2), 0.0
    for n in range(int(seconds)):
        board = int(n // board_s)
        want = (-1.0) ** (board // len(twa_deg)) * math.radians(twa_deg[board % len(twa_deg)])
        turn = (want - heading + math.pi) % (2.0 * math.pi) - math.pi
        heading = math.remainder(heading + float(np.clip(turn, -0.25, 0.25)) + 0.005 * rng.standard_normal(), math.tau)
        gust += -gust / 20.0 + 0.04 * rng.standard_normal()
        tws = 5.0 * math.exp(gust)
        of = share(abs(heading)) if callable(share) else share
        drive = of * BOAT.polar.speed_mps(heading, tws) if tow_mps is None or not tow_mps(n) else tow_mps(n)
        speed += (drive - speed) / (6.0 if stops < 1.0 else 2.0)
        speed *= stops if abs(heading) < 0.5 else 1.0
        velocity = speed * np.array([math.sin(heading), math.cos(heading)])
        here = here + velocity
        yield Look(
            t_s=float(n),
            here_en_m=(float(here[0]), float(here[1])),
            velocity_en_mps=(float(velocity[0]), float(velocity[1])),
            heading_rad=heading,
            wind_en_mps=(0.0, tws),
            doubt_mps=0.05,
        )


def after(hours, boat=BOAT, known=FILE, **more):
    now = Afloat.of(known)
    for look in looks(3600.0 * hours, **more):
        now = followed(now, look, boat)
    return now


def stretch(off=0.0, *, t_s=0.0, twa=90.0, boat=BOAT):
    angle = math.radians(twa)
    ahead = math.exp(off) * boat.polar.speed_mps(angle, 5.0)
    return Stretch(row=(t_s,), ahead_mps=ahead, twa_rad=angle, tws_mps=5.0, doubt_mps=0.05, length_s=30.0)


def learned_from(offs, known=FILE, boat=BOAT, **more):
    now = Afloat.of(known)
    for off in offs:
        now = _learned(now, stretch(off, boat=boat, **more), boat)
    return now.known


def share_of(known, twa_deg, tws_mps=5.0):
    return float(factor(known.told.x, math.radians(twa_deg), tws_mps))


def test_a_slow_boat_is_known_and_used_after_an_hour_and_not_before():
    now = Afloat.of(FILE)
    used_s = None
    for look in looks(3 * 3600.0, share=0.75):
        now = followed(now, look, BOAT)
        if now.known.is_used and used_s is None:
            used_s = look.t_s
            assert now.known.sailed_s >= PROOF_S
            assert now.saved.is_used  # on the disk at once
    assert used_s is not None
    assert PROOF_S < used_s < 2.0 * 3600.0
    for angle in (55.0, 90.0, 130.0):
        assert share_of(now.known, angle) == pytest.approx(0.75, abs=0.05)
    sailed = as_learned(BOAT, now.known.told)
    assert sailed.polar.speed_mps(math.radians(90.0), 5.0) == pytest.approx(
        0.75 * BOAT.polar.speed_mps(math.radians(90.0), 5.0), rel=0.06
    )
    assert sailed.speed_error < 0.15  # of 0.3
    assert now.known.own_error < 0.5 * now.known.file_error


def test_the_shape_is_learned_too():
    """She beats as her file says, and reaches and runs slower."""
    known = after(3.0, share=lambda off: 1.0 if off < 1.2 else 0.85).known
    assert share_of(known, 55.0) == pytest.approx(1.0, abs=0.05)
    assert share_of(known, 130.0) == pytest.approx(0.85, abs=0.05)


def test_of_a_boat_that_is_as_her_file_says_nothing_is_used():
    known = after(3.0, board_s=300.0).known
    assert known.sailed_s > 2.0 * PROOF_S
    assert not known.is_used
    assert share_of(known, 90.0) == pytest.approx(1.0, abs=0.05)


def test_a_manoeuvre_or_a_gap_is_no_steady_sailing():
    now = after(0.5, board_s=25.0)
    assert dict(now.left_out)[Why.MANOEUVRE] > 20
    assert not now.waiting
    now = Afloat.of(FILE)
    for look in looks(1800.0):
        if int(look.t_s) % 40 < 30:
            now = followed(now, look, BOAT)
    assert now.known.sailed_s == 0.0
    assert dict(now.left_out)[Why.UNKNOWN] > 20


def test_a_tow_is_left_out():
    def tow(n):
        return 3.2 if 1500 < n < 2700 else 0.0

    now = after(1.5, share=0.8, tow_mps=tow)
    assert dict(now.left_out)[Why.DRIVEN] > 20
    assert share_of(now.known, 90.0) == pytest.approx(1.0 - 0.2, abs=0.12)


def test_what_is_found_out_late_takes_back_the_minutes_before():
    now = after(0.18)
    assert len(now.waiting) > 8
    end_s = now.looks[-1].t_s
    for why in (Why.FROZEN_VANE, Why.RESET, Why.DOUBTED, Why.MOTOR):
        later = now.without(why)
        assert not later.looks
        assert later.waiting
        assert all(s.t_s < end_s - TAKEN_BACK_S for s in later.waiting)
        assert dict(later.left_out)[why] == 1
        assert later.without(why) == later
        lulled = now.without(Why.LIGHT)  # another reason came a second before
        assert lulled.waiting == now.waiting
        assert lulled.without(why).waiting == later.waiting
        assert lulled.without(why).without(why).waiting == later.waiting


def test_nothing_is_learned_from_a_stretch_before_ten_minutes_more_are_steady():
    now = Afloat.of(FILE)
    for look in looks(3600.0, board_s=600.0):
        now = followed(now, look, BOAT)
        if now.known.sailed_s > 0.0:
            assert len(now.waiting) == WAITING - 4
            break
    assert look.t_s > WAITING * 30.0


def test_plans_are_told_by_small_steps():
    known = FILE
    for n in range(200):
        was = known.told
        known = learned_from([-0.5], known)
        step = np.abs(np.array(known.told.x) - was.x)
        assert np.all(step <= np.array(STEPS) + 1e-9)
        if n < TOLD_EVERY_S / 30.0 - 1:
            assert was == Told()
    assert known.x[0] < -0.3
    assert known.told.x[0] == pytest.approx(-STEPS[0] * (200 * 30.0 // TOLD_EVERY_S), abs=0.1)


def test_what_is_learned_is_clamped():
    known = learned_from([1.2] * 400)
    assert abs(known.x[0]) <= 0.9
    assert float(factor(known.x, 0.5 * math.pi, 5.0)) == FASTEST
    known = learned_from([1.2] * 400, boat=replace(BOAT, speed_error=0.0))
    assert abs(known.x[0]) <= 3.0 * 0.12 + 1e-9


def test_one_stretch_that_is_unlike_all_others_moves_nothing_and_ten_in_a_row_do():
    known = learned_from([0.0, 0.02, -0.02] * 30)
    one = learned_from([-1.1], known)
    assert one.x == known.x
    assert one.unlike == 1
    assert learned_from([0.0], one).unlike == 0
    nearly = learned_from([-1.1] * (REOPEN - 1), known)
    assert nearly.x == known.x
    changed = learned_from([-1.1] * (REOPEN + 5), known)
    assert changed.x[0] < -0.4


def test_it_forgets_and_is_never_less_sure_than_the_file():
    known = learned_from([-0.2] * 60)
    wide = replace(known, p=tuple(tuple(100.0 * v for v in row) for row in known.p))
    assert learned_from([-0.2], wide).p[0][0] <= 0.3**2
    settled = learned_from([-0.2] * 1000)
    assert share_of(settled, 90.0) == pytest.approx(math.exp(-0.2), abs=0.01)
    later = learned_from([0.0] * 240, settled)
    assert float(factor(later.x, 0.5 * math.pi, 5.0)) > math.exp(-0.05)


def test_it_is_used_no_more_when_it_is_the_worse():
    known = learned_from([-0.3] * 240)
    assert known.is_used
    assert known.own_error < BETTER * known.file_error
    assert learned_from([-0.3] * 20, known).is_used
    worse = replace(known, own_error=1.3 * known.file_error)
    assert not learned_from([-0.3] * 20, worse).is_used
    back = learned_from([0.02, -0.02] * 200, known)  # her sails are mended
    assert share_of(back, 90.0) == pytest.approx(1.0, abs=0.02)


def test_a_stall_near_the_zone_widens_it_and_one_off_it_does_not():
    near = math.degrees(BOAT.no_go_half_rad) + 1.0
    sailed = learned_from([0.0] * 60)
    stalls = learned_from([math.log(0.4)] * 4, sailed, twa=near)
    assert stalls.stalled == (4, 0, 0)
    slow = learned_from([math.log(0.6)] * 200, twa=near)
    assert learned_from([math.log(0.4)], slow, twa=near).stalled == slow.stalled == (0, 0, 0)  # of what she makes
    told = learned_from([0.0] * 20, stalls).told
    assert told.wider_rad == pytest.approx(BIN)
    assert as_learned(BOAT, told).no_go_half_rad == pytest.approx(BOAT.no_go_half_rad + BIN)
    far = learned_from([math.log(0.4)] * 4 + [0.0] * 20, sailed, twa=near + 30.0)
    assert far.stalled == (0, 0, 0)
    assert far.told.wider_rad == 0.0
    held = learned_from([0.0] * 19, stalls, twa=near)
    assert learned_from([0.0], held, twa=near).told.wider_rad == 0.0  # she sails there more often


def test_what_tacks_cost_is_learned_by_steps():
    slow = after(2.5, twa_deg=(55.0,), stops=0.7).known
    (tacks, _), (gybes, _) = slow.losses
    assert tacks >= LEAST_MANOEUVRES
    assert gybes == 0
    assert slow.told.tack_loss_s > 1.2 * BOAT.tack_loss_s
    assert slow.told.gybe_loss_s is None
    quick = after(2.5, twa_deg=(55.0,)).known
    assert quick.told.tack_loss_s < slow.told.tack_loss_s


def test_frozen_it_stays_as_it_is():
    known = replace(FILE, is_frozen=True)
    assert after(0.6, known=known, share=0.6).known == known


def test_of_another_file_it_knows_nothing():
    known = learned_from([-0.3] * 240)
    other = replace(BOAT, no_go_half_rad=math.radians(50.0))
    now = followed(Afloat.of(known), next(looks(1)), other)
    assert now.known == LearnedAfloat(of=mark_of(other))


def test_it_survives_a_restart_and_nonsense_does_not():
    known = replace(after(2.0, share=0.75).known, is_frozen=True)
    data = json.loads(json.dumps(known.to_dict()))
    assert LearnedAfloat.from_dict(data) == known
    fresh = json.loads(json.dumps(FILE.to_dict()))
    assert LearnedAfloat.from_dict(fresh) == FILE
    for key, wrong in (
        ("x", [0.0, 0.0]),
        ("x", [math.nan] * 4),
        ("x", "abcd"),
        ("p", [[0.0] * 4] * 4),
        ("p", [[1.0, 0.0]]),
        ("told", []),
        ("told", [[0.0] * 4, True, None, None, None]),
        ("held", [1, 2]),
        ("held", [-1, 0, 0]),
        ("losses", [[1, 2.0]]),
        ("losses", [[1.5, 2.0], [0, 0.0]]),
        ("used", 1),
        ("of", -1),
        ("sailed_s", [math.inf, 0.0]),
    ):
        with pytest.raises((ValueError, TypeError, IndexError)):
            LearnedAfloat.from_dict(data | {key: wrong})


def test_a_told_figure_out_of_bounds_is_brought_back():
    data = FILE.to_dict() | {"told": [[0.0] * 4, 9.0, 7.0, -1.0, None]}
    told = LearnedAfloat.from_dict(data).told
    assert (told.wider_rad, told.speed_error, told.tack_loss_s) == (pytest.approx(3 * BIN), 1.0, 0.0)
