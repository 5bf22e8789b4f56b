"""The stamps of signed frames on disk: their clock, how far ahead they are kept, what is damage."""

import errno
import math
import os
from datetime import UTC, datetime
from pathlib import Path

import pytest

from companion.errors import InputError
from companion.mavlink.signing import SigningStore, make_key, read_key

TICKS = 100_000  # of 10 µs in a second
YEAR = 366 * 86_400 * TICKS
NOW_S = datetime(2026, 6, 1, tzinfo=UTC).timestamp()


@pytest.fixture
def key(tmp_path):
    path = tmp_path / "key"
    path.write_text("ab" * 32)
    path.chmod(0o600)
    return path


def kept(key):
    return int(key.with_name("key.timestamp").read_text())


@pytest.mark.parametrize(("day", "seconds"), [((2015, 1, 1), 0), ((2015, 1, 2), 86_400), ((2014, 6, 1), 0)])
def test_stamps_count_ten_microseconds_from_new_year_2015_and_never_below(key, day, seconds):
    """MAVLink's own zero: another would have every frame refused, or be years ahead of everybody."""
    store = SigningStore(key, datetime(*day, tzinfo=UTC).timestamp())
    assert store.state.timestamp == seconds * TICKS
    assert store.state.key == read_key(key) == bytes.fromhex("ab" * 32)


def test_what_is_kept_is_ahead_of_use_by_less_than_the_minute_that_shuts_others_out(key):
    store = SigningStore(key, NOW_S)
    assert 20 * TICKS < kept(key) - store.state.timestamp < 60 * TICKS
    assert SigningStore(key, NOW_S + 5.0).state.timestamp - int((NOW_S + 5.0 - 1_420_070_400) * TICKS) < 60 * TICKS


def test_it_is_kept_anew_when_half_of_the_lead_is_used_and_not_at_every_frame(key):
    store = SigningStore(key, NOW_S)
    store.follow(1000.0)
    first = kept(key)
    store.state.timestamp = store.follow(1019.0)
    store.save()
    assert kept(key) == first
    store.state.timestamp = store.follow(1021.0)
    store.save()
    assert kept(key) - first == 21 * TICKS


def test_a_stamp_in_the_last_year_of_its_48_bits_is_damage_and_one_before_is_believed(key, caplog):
    last = 2**48 - 1 - YEAR
    stamps = key.with_name("key.timestamp")
    stamps.write_text(str(last))
    assert SigningStore(key, NOW_S).state.timestamp == last
    assert not caplog.text
    stamps.write_text(str(last + 1))
    assert SigningStore(key, NOW_S).state.timestamp == math.floor((NOW_S - 1_420_070_400) * TICKS)
    assert "no timestamp of a signature" in caplog.text


def test_a_clock_out_of_its_mind_leaves_a_year_of_stamps(key):
    assert SigningStore(key, 1e11).state.timestamp == 2**48 - 1 - YEAR


@pytest.mark.parametrize("damage", ["torn", "directory", "link"])
def test_on_a_board_without_a_clock_damage_is_the_beginning_of_time(key, caplog, damage):
    """A link is somebody else's file: neither read nor written through."""
    stamps, other = key.with_name("key.timestamp"), key.with_name("other")
    other.write_text(str(500 * TICKS))
    if damage == "torn":
        stamps.write_text("12x")
    elif damage == "directory":
        stamps.mkdir()
    else:
        stamps.symlink_to(other)
    assert SigningStore(key, 0.0).state.timestamp == 0
    assert "written anew" in caplog.text
    assert other.read_text() == str(500 * TICKS)


def test_a_key_is_whole_on_the_disk_when_it_is_said_to_be_there(tmp_path, monkeypatch):
    """A power cut behind it leaves the key that the autopilot was given: else she can be signed to no more."""
    synced, path, fds = [], tmp_path / "boat.key", len([*Path("/proc/self/fd").iterdir()])
    sync = os.fsync
    monkeypatch.setattr(os, "fsync", lambda fd: (synced.append(str(Path(f"/proc/self/fd/{fd}").readlink())), sync(fd)))
    make_key(path)
    assert synced == [str(path), str(tmp_path)]
    assert len([*Path("/proc/self/fd").iterdir()]) == fds


def of_clock(unix_s):
    return int((unix_s - 1_420_070_400) * TICKS)


def test_restarts_do_not_add_up_to_the_minute_that_shuts_others_out(key):
    """Each began where the last had stored, 40 s ahead, and went on from there: after two no station could join."""
    last = 0
    for n in range(12):
        now_s = NOW_S + 5.0 * n
        store = SigningStore(key, now_s)
        assert store.state.timestamp > last, "never twice, never back"
        assert store.state.timestamp - of_clock(now_s) < 60 * TICKS
        for second in range(4):
            store.state.timestamp = max(store.state.timestamp + 50, store.follow(1000.0 + second))  # fifty frames
            store.save()
        last = store.state.timestamp
        assert last < kept(key)


def test_what_began_ahead_of_the_clock_waits_for_it(key):
    SigningStore(key, NOW_S)
    store = SigningStore(key, NOW_S + 5.0)
    assert store.state.timestamp == of_clock(NOW_S + 40.0)
    assert store.follow(1000.0) == of_clock(NOW_S + 5.0)
    assert store.follow(1034.0) < store.state.timestamp < store.follow(1036.0) == of_clock(NOW_S + 41.0)
    store.state.timestamp = store.follow(4600.0)
    store.save()
    assert kept(key) == of_clock(NOW_S + 3605.0) + 40 * TICKS
    assert store.follow(4500.0) == store.follow(4600.0)  # a clock that was set back


def test_a_board_without_a_clock_goes_on_in_time_from_what_is_stored(key):
    """It must not fall behind the autopilot's clock: a newcomer a minute behind is refused."""
    SigningStore(key, NOW_S)
    store = SigningStore(key, 0.0)
    assert store.state.timestamp == store.follow(10.0) == of_clock(NOW_S + 40.0)
    assert store.follow(3610.0) == of_clock(NOW_S + 3640.0)


def test_frames_that_outrun_the_clock_are_kept_ahead_of_too(key):
    """An autopilot whose clock is ahead moves ours."""
    store = SigningStore(key, NOW_S)
    store.state.timestamp = of_clock(NOW_S + 500.0)
    store.save()
    assert of_clock(NOW_S + 500.0) < kept(key) <= of_clock(NOW_S + 501.0)


@pytest.mark.parametrize(("behind_s", "waits"), [(3500.0, True), (3700.0, False)])
def test_a_clock_more_than_an_hour_behind_what_is_kept_is_none(key, behind_s, waits):
    key.with_name("key.timestamp").write_text(str(of_clock(NOW_S)))
    store = SigningStore(key, NOW_S - behind_s)
    assert store.state.timestamp == of_clock(NOW_S)
    assert store.follow(0.0) == of_clock(NOW_S - behind_s if waits else NOW_S)


def test_ahead_of_the_clock_it_is_kept_anew_when_frames_have_used_half_a_second_of_what_is_spared(key):
    SigningStore(key, NOW_S)
    store = SigningStore(key, NOW_S + 5.0)  # begins at 40 s, keeps 45
    assert kept(key) == of_clock(NOW_S + 45.0)
    store.state.timestamp = of_clock(NOW_S + 44.4)
    store.save()
    assert kept(key) == of_clock(NOW_S + 45.0)
    store.state.timestamp = of_clock(NOW_S + 44.6)
    store.save()
    assert kept(key) == store.state.timestamp + TICKS


def test_a_key_that_a_full_disk_does_not_take_leaves_no_file(tmp_path, monkeypatch):
    """An empty one stayed, which is no key, and is not written over."""

    def full(fd, data):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    with monkeypatch.context() as patched:
        patched.setattr(os, "write", full)
        with pytest.raises(InputError, match="No space left"):
            make_key(tmp_path / "boat.key")
    assert not (tmp_path / "boat.key").exists()
    make_key(tmp_path / "boat.key")
