"""``companion far``: orders made and statuses read ashore; each slip is one line."""

import subprocess
import sys
import time

import pytest

from companion import cli
from companion.messages import GeoPoint
from companion.orders import Verb
from companion.orders.far import FarKey, FarStatus, Reply, minutes_of, pack_status
from tests.orders.far import by_the_page

HEX_KEY = bytes(range(32)).hex()


@pytest.fixture
def key(tmp_path):
    path = tmp_path / "far.key"
    path.write_text(HEX_KEY)
    path.chmod(0o600)
    return path


def run(capsys, *words):
    code = cli.main(["far", *map(str, words)])
    told = capsys.readouterr()
    assert told.err.count("\n") == (code != 0)
    return code, told.out, told.err


def test_orders_are_made_as_the_page_says_and_counted(key, tmp_path, capsys):
    out = tmp_path / "o.sbd"
    code, told, _ = run(capsys, "order", "goal", "50.8195", "-1.3080", "--key", key, "--expires", "2h", "--out", out)
    assert code == 0
    counts = by_the_page.read("The order", out.read_bytes(), bytes(range(32)))
    assert (counts["verb"], counts["counter"], counts["lat"], counts["lon"]) == (6, 1, 508195000, -13080000)
    assert 0 <= counts["expires"] - minutes_of(time.time() + 7200.0) <= 1
    assert told.splitlines()[0] == out.read_bytes().hex()
    assert "order 1: goal 50.81950 -1.30800, counts until 20" in told
    _, told, _ = run(capsys, "order", "refuge", "Mill", "Bay", "--key", key, "--expires", "1d", "--system", 3)
    assert by_the_page.read("The order", bytes.fromhex(told.splitlines()[0]), bytes(range(32)), 3)["counter"] == 2
    run(capsys, "order", "hold", "--key", key, "--expires", "90m", "--counter", 40)
    assert (tmp_path / "far.key.far-counter").read_text() == "40\n"


@pytest.mark.parametrize(
    ("words", "why"),
    [
        (["jump", "--expires", "2h"], "there is no order 'jump'"),
        (["hold", "--expires", "30s"], "is not a time; write 90m, 2h or 1d"),
        (["hold", "--expires", "8d"], "is out of range; from 1m to 7d"),
        (["hold"], "--expires"),
        (["goal", "0", "0", "--expires", "2h"], "no position that anybody means"),
        (["refuge", "300", "--expires", "2h"], "too large"),
    ],
)
def test_what_cannot_be_ordered_is_one_line_and_uses_no_counter(key, tmp_path, capsys, words, why):
    code, _, err = run(capsys, "order", *words, "--key", key)
    assert code == 2
    assert why in err
    assert not (tmp_path / "far.key.far-counter").exists()


@pytest.mark.parametrize("given", [2, 3])
def test_a_counter_that_was_used_is_refused_ashore(key, tmp_path, capsys, given):
    for _ in range(3):
        run(capsys, "order", "hold", "--key", key, "--expires", "2h")
    code, out, err = run(capsys, "order", "hold", "--key", key, "--expires", "2h", "--counter", given)
    assert (code, out) == (2, "")
    assert "is not after the last, 3" in err
    assert (tmp_path / "far.key.far-counter").read_text() == "3\n"
    assert run(capsys, "order", "hold", "--key", key, "--expires", "2h", "--counter", 4)[0] == 0


def test_a_slip_of_the_counter_is_refused_ashore(key, tmp_path, capsys):
    run(capsys, "order", "hold", "--key", key, "--expires", "2h")
    code, _, err = run(capsys, "order", "hold", "--key", key, "--expires", "2h", "--counter", 65535)
    assert (code, "more than 1024 ahead of the last, 1" in err, "companion far begin" in err) == (2, True, True)
    assert (tmp_path / "far.key.far-counter").read_text() == "1\n"


@pytest.mark.parametrize("kept", ["65535\n", "torn", "70000", "-3", "5 99999999"])
def test_from_any_count_the_shore_begins_anew(key, tmp_path, capsys, kept):
    counter, out = tmp_path / "far.key.far-counter", tmp_path / "begin.sbd"
    counter.write_text(kept)
    code, told, _ = run(capsys, "begin", "--key", key, "--expires", "1d", "--out", out)
    counts = by_the_page.read("The beginning", out.read_bytes(), bytes(range(32)))
    assert (code, told.splitlines()[0]) == (0, out.read_bytes().hex())
    assert 0 <= minutes_of(time.time()) - counts["began"] <= 1
    assert 0 <= counts["expires"] - minutes_of(time.time() + 86_400.0) <= 1
    _, told, _ = run(capsys, "order", "hold", "--key", key, "--expires", "2h")
    order = by_the_page.read("The order", bytes.fromhex(told.splitlines()[0]), bytes(range(32)), 1, counts["began"])
    assert (order["counter"], counter.read_text()) == (1, f"1 {counts['began']}\n")
    run(capsys, "begin", "--key", key, "--expires", "1d")
    assert counter.read_text() == f"0 {counts['began'] + 1}\n", "later than the one before, within one minute too"


def test_a_counter_that_is_lost_or_used_up_is_one_line(key, tmp_path, capsys):
    (tmp_path / "far.key.far-counter").write_text("torn")
    code, _, err = run(capsys, "order", "hold", "--key", key, "--expires", "2h")
    assert (code, "name one with --counter" in err) == (2, True)
    (tmp_path / "far.key.far-counter").write_text("65535")
    code, _, err = run(capsys, "order", "hold", "--key", key, "--expires", "2h")
    assert (code, "companion far begin" in err) == (1, True)


def test_a_file_that_is_there_is_not_written_over(key, tmp_path, capsys):
    (tmp_path / "o").write_text("mine")
    code, _, err = run(capsys, "order", "hold", "--key", key, "--expires", "2h", "--out", tmp_path / "o")
    assert (code, "--force" in err, (tmp_path / "o").read_text()) == (2, True, "mine")


def test_a_status_is_read_in_words_from_a_file_or_digits(key, tmp_path, capsys):
    status = FarStatus(
        phase="holding",
        minute=minutes_of(time.time() - 840.0),
        is_heard=True,
        is_armed=True,
        is_under_way=True,
        standing=Verb.HOLD,
        position=GeoPoint(lat_deg=50.8195, lon_deg=-1.308),
        speed_mps=1.4,
        battery_v=12.4,
        watchdog="becalmed",
        order=17,
        reply=Reply.DONE,
        goal=1,
        goals=3,
        has_trouble=True,
    )
    data = pack_status(status, FarKey(bytes(range(32)), 1))
    begun = pack_status(FarStatus(phase="holding", reply=Reply.BEGUN), FarKey(bytes(range(32)), 1))
    assert run(capsys, "status", begun.hex(), "--key", key)[1].endswith("\nbegun anew: counters count from 1\n")
    (tmp_path / "raw").write_bytes(data)
    (tmp_path / "hex").write_text(data.hex() + "\n")
    sources = (tmp_path / "raw", tmp_path / "hex", data.hex())
    told = {run(capsys, "status", source, "--key", key)[1] for source in sources}
    (text,) = told
    for words in (
        "14 min ago",
        "HOLDING, under way, armed; under the order hold",
        "at 50.81950 -1.30800, 1.4 m/s",
        "goal 1 of 3, - m to it",
        "wind from - ± - deg",
        "12.4 V; BECALMED",
        "her disk does not keep",
        "order 17: done",
    ):
        assert words in text


@pytest.mark.parametrize(
    ("source", "why"),
    [
        ("00" * 42, "its code is wrong"),
        ("00", "it has 1 bytes, and not 42"),
        ("nope.sbd", "nope.sbd: no such file, and no hexadecimal digits; name the file of the message, or paste its "),
        ("abc", "abc: is an odd number of hexadecimal digits; paste all of them"),
        (".", ".: is a folder; "),
    ],
)
def test_what_is_no_status_is_one_line(key, capsys, source, why):
    code, _, err = run(capsys, "status", source, "--key", key)
    assert code == 2
    assert why in err
    assert source == "00" or "42 bytes" not in err


def test_a_boat_without_a_key_for_it_is_not_begun(tmp_path, capsys):
    words = ["run", "sitl/missions/open-water.toml", "--link", "udpin:127.0.0.1:1"]
    assert cli.main([*words, "--far", str(tmp_path / "far")]) == 2
    assert "has no key; make one with `companion key new" in capsys.readouterr().err
    assert cli.main([*words, "--far-key", "k"]) == 2
    assert "name its folder: --far DIR" in capsys.readouterr().err


def test_two_at_once_have_a_counter_each(key, tmp_path):
    words = [sys.executable, "-m", "companion.cli", "far", "order", "hold", "--key", str(key), "--expires", "2h"]
    started = [subprocess.Popen(words, stdout=subprocess.PIPE, text=True) for _ in range(4)]
    told = [process.communicate()[0] for process in started]
    assert sorted(text.splitlines()[1].split(":")[0] for text in told) == [f"order {n}" for n in range(1, 5)]
