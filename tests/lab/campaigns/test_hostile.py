"""The hostile client: it forges all that the companion reads, and docs/reference/mavlink.md says what comes of it."""

import ast
import asyncio
import socket
from pathlib import Path

import pytest
from pymavlink.dialects.v20 import ardupilotmega as wire

from companion.clock import run
from companion.errors import InputError
from companion.mavlink.link import Link
from companion.mavlink.transports import open_link
from companion.mavlink.wire.frames import Codec, Drop, SigningState
from lab.campaigns.hostile import (
    AGAINST_A_KEY,
    BEGIN,
    END,
    HOSTILITIES,
    LISTENING,
    measure,
    measure_together,
    rows,
    written,
)
from lab.campaigns.reads import ASHORE, READS
from lab.campaigns.signed_link import ManInTheMiddle, Signer, SpoofingPlan
from sitl import cli
from sitl.autopilot import AutopilotConfig, SimulatedAutopilot, serve
from sitl.faults.spoofing import FORGERIES, Forger
from sitl.world.environment import Constant

DOCUMENT = Path("docs/reference/mavlink.md")
# Names of messages in the code that are not read there: sent, asked for, or counted.
NOT_READ = {
    ("MISSION_CLEAR_ALL", "mavsdk_session"),
    *(
        (name, "vehicle")
        for name in ("WIND", "GLOBAL_POSITION_INT", "ATTITUDE", "MISSION_CURRENT", "EKF_STATUS_REPORT")
    ),
}
TABLES = {"streams", "safety", "reads"}
RECORDINGS = Path("companion/boat_logs")  # are read there, and nobody forges those
KEY = b"0123456789abcdef" * 2


def table():
    """Return the document's rows by message and what is forged: the effects by the name of who forges."""
    text = DOCUMENT.read_text(encoding="utf-8")
    lines = text.split(BEGIN)[1].split(END)[0].strip().splitlines()
    cells = [[cell.strip() for cell in line.strip("|").split("|")] for line in lines]
    assert cells[0] == ["message", "read by", "forged", *(who.name for who in HOSTILITIES)]
    return {(row[0].strip("`"), row[2]): (row[1], dict(zip(cells[0][3:], row[3:], strict=True))) for row in cells[2:]}


def test_the_table_of_messages_is_that_of_the_code():
    names = {kind.msgname for kind in wire.mavlink_map.values()}
    found = {
        (node.value, path.stem)
        for path in Path("companion").rglob("*.py")
        if path.stem not in TABLES and RECORDINGS not in path.parents
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and node.value in names
    }
    assert found - NOT_READ == {(name, module) for name, modules in READS.items() for module in modules}


def test_everything_that_is_read_is_forged_and_documented():
    assert {f.message for f in FORGERIES} | ASHORE == set(READS)
    assert list(table()) == [(f.message, f.says) for f in FORGERIES]
    assert all(read_by == ", ".join(READS[name]) for (name, _), (read_by, _) in table().items())


def test_with_a_key_nothing_of_it_does_anything(tmp_path):
    assert measure_together(AGAINST_A_KEY, tmp_path) == ()
    assert {effects[AGAINST_A_KEY.name] for _, effects in table().values()} == {"-"}


SOME = {"300 m off", "another board", "SAIL_NO_GO_ANGLE 90", "SAIL_NO_GO_ANGLE 80, of a gimbal"}


def test_what_one_who_listens_can_do_is_what_is_documented(tmp_path):
    some = [f for f in FORGERIES if f.says in SOME and f.message != "HOME_POSITION"]
    for forgery, effect in measure(LISTENING, tmp_path, some).items():
        assert (", ".join(effect) or "-") == table()[forgery.message, forgery.says][1][LISTENING.name], forgery


@pytest.mark.campaign
def test_the_whole_table_is_as_measured(tmp_path):
    lines = rows({who.name: measure(who, tmp_path / who.name) for who in HOSTILITIES})
    text = DOCUMENT.read_text(encoding="utf-8")
    assert text == written(text, lines), "run: sitl hostile --document docs/reference/mavlink.md"


def test_no_forgery_makes_the_companion_set_a_mode_arm_or_steer_but_one_of_the_wind_that_has_her_loiter():
    """A wind that leaps is held for in LOITER: a forged one cannot be told from a vane that was turned."""
    for (message, says), (_, effects) in table().items():
        for effect in effects.values():
            asked = effect.replace("orders stop", "")
            if message == "WIND":
                asked = asked.replace('orders LOITER, says "held", says "wind contradicted"', "")
            assert "orders " not in asked, (message, says)
            assert "steers" not in effect, (message, says)


# ------------------------------------------------------------------------------------------ its parts
def test_a_signed_frame_is_taken_with_the_key_and_stripped_again():
    frame = Codec(1, 1).pack(wire.MAVLink_heartbeat_message(11, 3, 0, 4, 3, 3))
    signed = Signer(KEY, 1000).sign(frame)
    good = Codec(9, 9, SigningState(key=KEY))
    assert [m.get_type() for m in good.feed(signed)] == ["HEARTBEAT"]
    bad = Codec(9, 9, SigningState(key=bytes(32)))
    assert not bad.feed(signed)
    assert bad.dropped[Drop.BAD_SIGNATURE]
    assert Signer.strip(signed) == frame


@pytest.mark.parametrize("key", [None, bytes(32)])
def test_no_forgery_passes_a_key(key):
    codec, forger = Codec(9, 9, SigningState(key=KEY, timestamp=10**9)), Forger(listens=True, key=key, timestamp=2**40)
    assert not any(codec.feed(forger.frame(5.0, forgery)) for forgery in FORGERIES)
    assert codec.dropped[Drop.UNSIGNED if key is None else Drop.BAD_SIGNATURE] >= len(FORGERIES)


def test_one_who_has_the_key_is_believed():
    codec, forger = Codec(9, 9, SigningState(key=KEY)), Forger(listens=True, key=KEY, timestamp=2**40)
    assert all(codec.feed(forger.frame(5.0, forgery)) for forgery in FORGERIES)


def free_port():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


def test_between_a_live_boat_and_a_companion_it_passes_on_and_adds_its_own():
    boat_port, companion_port = free_port(), free_port()
    boat = SimulatedAutopilot(AutopilotConfig(is_warm=True, is_moored=True), Constant(0.0, 5.0), 1)
    plan = SpoofingPlan(forgeries=FORGERIES[:1], rate_hz=20.0, count=40, for_s=12.0)
    middle = ManInTheMiddle(f"udpout:127.0.0.1:{boat_port}", f"udpout:127.0.0.1:{companion_port}", plan)

    async def main():
        async with (
            serve(boat, [f"udpin:127.0.0.1:{boat_port}"]),
            Link(open_link(f"udpin:127.0.0.1:{companion_port}")) as link,
        ):
            work = asyncio.create_task(middle.run())
            party = await link.wait_autopilot(10.0)
            await work
            return party, link.stats

    party, stats = run(main(), speedup=4.0)
    assert party.target_system == 1
    assert middle.sent == 40
    assert middle.passed > 5000
    assert stats.frames_in > 60
    assert not stats.faults


@pytest.mark.parametrize(
    ("argv", "words"),
    [
        (["--boat", "udpout:10.0.0.1:14555", "--companion", "udpout:127.0.0.1:9"], "is not on the loopback"),
        (["--boat", "/dev/null", "--companion", "udpout:127.0.0.1:9"], "is not on the loopback"),
        (["--boat", "udpout:127.0.0.1:9"], "only one of them is given"),
        (["--boat", "udpout:127.0.0.1:9", "--companion", "udpout:127.0.0.1:9", "--rate", "1e9"], "at most 500"),
        (["--boat", "udpout:127.0.0.1:9", "--companion", "udpout:127.0.0.1:9", "--rate", "nan"], "at most 500"),
        (
            ["--boat", "udpout:127.0.0.1:9", "--companion", "udpout:127.0.0.1:9", "--count", "0"],
            "at least 1 and at most 100000",
        ),
        (["--boat", "udpout:127.0.0.1:9", "--companion", "udpout:127.0.0.1:9", "--message", "FOO"], "--list"),
        (["--document", "nowhere.md"], "cannot be read"),
        (["--document", "README.md"], "is not in the file"),
    ],
)
def test_bad_usage_is_one_line_and_nothing_is_sent(capsys, argv, words):
    assert cli.main(["hostile", *argv]) == 2
    err = capsys.readouterr().err
    assert words in err
    assert err.count("\n") == 1


def test_the_forgeries_are_listed(capsys):
    assert cli.main(["hostile", "--list"]) == 0
    assert len(capsys.readouterr().out.splitlines()) == len(FORGERIES) + 1


def test_a_document_without_marks_is_an_error():
    with pytest.raises(InputError):
        written("nothing", [])
    assert written(f"a\n{BEGIN}\nold\n{END}\nb", ["new"]) == f"a\n{BEGIN}\nnew\n{END}\nb"
