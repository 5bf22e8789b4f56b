"""The mailbox of a satellite modem: whole files, orders once, what is no order, restarts, a folder that fails."""

import asyncio
import errno
import json
import os
from types import SimpleNamespace

import pytest

from companion.app import satellite
from companion.app.local_clients import OperatorCommands
from companion.app.options import SatelliteLink, at_once
from companion.app.satellite import ASIDE, IN, LOOK_S, MOST_ASIDE, OUT, TAKEN, TRIES, SatelliteMailbox
from companion.clock import run_virtual
from companion.disk import Disk
from companion.mavlink.link import Link
from companion.messages import AutopilotStatus, CompanionStatus
from companion.orders import Result, Verb, Wanted
from companion.orders.far import (
    Beginning,
    FarKey,
    FarOrder,
    Reply,
    minutes_of,
    pack_beginning,
    pack_order,
    unpack_status,
)
from companion.skipper.step import Acknowledge, Snapshot
from companion.skipper.step.state import SkipperState, VoyageState
from sitl.autopilot import MemoryLink
from sitl.faults.computer_faults import FaultyDisk
from tests.orders.far import by_the_page

KEY = FarKey(bytes(range(32)), 1)
UTC_S = 1_790_000_000.0


def sealed(counter=1, verb=Verb.HOLD, left_s=3600.0, key=KEY):
    return pack_order(FarOrder(wanted=Wanted(verb=verb), counter=counter, expires_min=minutes_of(UTC_S + left_s)), key)


def beginning(ago_s=0.0):
    began = minutes_of(UTC_S - ago_s)
    return began, pack_beginning(Beginning(began=began, expires_min=minutes_of(UTC_S + 86_400.0)), KEY)


def seen(t_s=0.0, utc_s=UTC_S):
    """Return a status and as much of its step as is told far away."""
    autopilot = AutopilotStatus(t_s=t_s, boot_s=100.0, utc_at_boot_s=None if utc_s is None else utc_s - 100.0)
    step = SimpleNamespace(
        snapshot=Snapshot(t_s=t_s, autopilot=autopilot), state=SkipperState(voyage=VoyageState(sailing=True))
    )
    return CompanionStatus(t_s=t_s, state="standard", battery_v=12.2), step


class Voyage:
    """A real crew whose orders are answered at once, and a mailbox beside it."""

    def __init__(self, folder, *, disk=None, utc_s=UTC_S, has_answers=True):
        self.folder, self.disk, self.utc_s, self.has_answers = folder, disk or Disk(), utc_s, has_answers
        self.orders, self.said, self.records = [], [], []
        self.operator = OperatorCommands(Link(MemoryLink().near), has_key=False)
        self.operator.begin()

    def sail(self, *looks):
        """Run the mailbox for a moment after each of ``looks`` was done; return the last status."""

        async def whole():
            box = SatelliteMailbox(
                SatelliteLink(folder=self.folder, key=KEY.key, every_s=600.0),
                1,
                self.operator,
                disk=self.disk,
                offload=at_once,
                is_durable=False,
                seen=lambda: seen(utc_s=self.utc_s),
                is_heard=lambda: True,
                has_trouble=lambda: False,
                say=lambda severity, text: self.said.append(text),
                record=self.records.append,
            )
            async with asyncio.TaskGroup() as group:
                tasks = [group.create_task(box.run()), group.create_task(self.answer())]
                await asyncio.sleep(LOOK_S / 2.0)
                for look in looks:
                    look()
                    await asyncio.sleep(LOOK_S)
                for task in tasks:
                    task.cancel()

        run_virtual(whole())
        out = self.folder / OUT
        return unpack_status(out.read_bytes(), KEY) if out.exists() else None

    async def answer(self):
        while True:
            for order in self.operator.take() if self.has_answers else ():
                self.orders.append(order)
                self.operator.answered(
                    Acknowledge(
                        way="far",
                        system=0,
                        component=order.source.component,
                        command=0,
                        result=Result.DONE,
                        text="so be it",
                    )
                )
            await asyncio.sleep(0.2)

    def put(self, data, name="000001.sbd"):
        def do():
            (self.folder / IN / name).write_bytes(data)

        return do

    @property
    def waiting(self):
        return sorted(path.name for path in (self.folder / IN).iterdir())


def test_an_order_is_done_once_and_answered_in_the_next_status(tmp_path):
    voyage = Voyage(tmp_path)
    status = voyage.sail(voyage.put(sealed()), voyage.put(sealed(), "again"))
    assert [(o.wanted.verb, o.source.kind, o.authority) for o in voyage.orders] == [(Verb.HOLD, "far", "far")]
    assert (status.order, status.reply, status.battery_v) == (1, Reply.DONE, pytest.approx(12.2))
    assert status.minute == minutes_of(UTC_S)
    counts = by_the_page.read("The status", (tmp_path / OUT).read_bytes(), KEY.key)
    assert (counts["order"], counts["reply"], counts["minute"], counts["phase"]) == (1, 0xF1, minutes_of(UTC_S), 2)
    assert voyage.waiting == []
    assert any("nothing is done twice" in record["text"] for record in voyage.records)


def test_after_a_restart_nothing_is_done_twice_and_the_reply_is_still_told(tmp_path):
    first = Voyage(tmp_path)
    first.sail(first.put(sealed()))
    second = Voyage(tmp_path)
    assert second.sail().reply is Reply.DONE
    assert second.sail(second.put(sealed()), second.put(sealed(2, Verb.GO_ON))).order == 2
    assert [o.wanted.verb for o in second.orders] == [Verb.GO_ON]


def test_killed_between_taking_and_doing_an_order_is_lost_and_the_status_says_so(tmp_path):
    first = Voyage(tmp_path, has_answers=False)
    first.sail(first.put(sealed()))
    assert json.loads((tmp_path / TAKEN).read_text())["replies"]["1"][1] == Reply.TAKEN
    assert first.waiting == ["000001.sbd"], "it was not removed: the power went"
    second = Voyage(tmp_path)
    status = second.sail()
    assert (status.order, status.reply, second.orders, second.waiting) == (1, Reply.TAKEN, [], [])


@pytest.mark.parametrize(
    ("left_s", "utc_s", "reply"),
    [(-7200.0, UTC_S, Reply.EXPIRED), (3600.0, None, Reply.NO_CLOCK), (9e6, UTC_S, Reply.TOO_LONG)],
)
def test_what_does_not_count_is_said_and_told(tmp_path, left_s, utc_s, reply):
    voyage = Voyage(tmp_path, utc_s=utc_s)
    status = voyage.sail(voyage.put(sealed(left_s=left_s)))
    assert (voyage.orders, status.order, status.reply, voyage.waiting) == ([], 1, reply, [])
    assert [text for text in voyage.said if text.endswith(str(reply))]


def test_what_is_no_order_is_removed_and_said_once_and_what_is_not_whole_is_left(tmp_path):
    voyage = Voyage(tmp_path)

    def flood():
        for n in range(12):
            voyage.put(b"x" * 24, f"a{n}")()
        for name in (".hidden", "b.tmp", "b.part", "b.new"):
            voyage.put(sealed(), name)()
        voyage.put(b"y" * 100_000, "long")()
        (tmp_path / IN / "folder").mkdir()

    status = voyage.sail(flood)
    assert voyage.waiting == [".hidden", "b.new", "b.part", "b.tmp", "folder"]
    assert (status.order, voyage.orders) == (None, [])
    assert len(voyage.said) == 2
    assert "its code is wrong" in voyage.said[0]


def test_a_disk_that_keeps_nothing_does_not_stop_an_order(tmp_path):
    disk = FaultyDisk()
    voyage = Voyage(tmp_path, disk=disk)

    def fill():
        disk.become("full")
        voyage.put(sealed())()

    voyage.sail(fill, voyage.put(sealed(), "again"))
    assert len(voyage.orders) == 1
    assert any("the folder of the satellite link" in text for text in voyage.said)


def test_a_memory_that_is_damaged_is_said_and_not_believed(tmp_path):
    (tmp_path / TAKEN).write_text("{torn")
    voyage = Voyage(tmp_path)
    assert voyage.sail(voyage.put(sealed())).reply is Reply.DONE
    assert "would count again" in voyage.said[0]


def test_a_folder_that_is_taken_away_is_said_and_not_worth_the_voyage(tmp_path):
    voyage = Voyage(tmp_path / "far")

    def remove():
        for path in sorted((tmp_path / "far").rglob("*"), reverse=True):
            path.rmdir() if path.is_dir() else path.unlink()

    voyage.sail(remove)
    assert len([text for text in voyage.said if "the folder of the satellite link" in text]) == 1


def put_aside(folder):
    return [path.name for path in (folder / ASIDE).iterdir()]


def unreadable(kind, path):
    if kind == "loop":
        path.symlink_to(path.name)
    elif kind == "pipe":
        os.mkfifo(path)
    else:
        path.write_bytes(sealed())


@pytest.mark.parametrize("kind", ["loop", "pipe", "sick"])
def test_a_message_that_cannot_be_read_is_put_aside_and_keeps_no_other_out(tmp_path, monkeypatch, kind):
    """One unreadable file stood in the way of every order behind it."""

    def sick(path, most_bytes, read=satellite.read_regular, **how):
        if path.name == "000000\x1b[2J.sbd" and kind == "sick":
            raise OSError(errno.EIO, "Input/output error", str(path))
        return read(path, most_bytes, **how)

    monkeypatch.setattr(satellite, "read_regular", sick)
    voyage = Voyage(tmp_path)
    status = voyage.sail(
        lambda: unreadable(kind, tmp_path / IN / "000000\x1b[2J.sbd"), voyage.put(sealed()), *[lambda: None] * TRIES
    )
    assert (status.order, status.reply, voyage.waiting) == (1, Reply.DONE, [])
    assert put_aside(tmp_path) == ["000000\x1b[2J.sbd"]
    (said,) = (text for text in voyage.said if ASIDE in text)
    assert r"'000000\x1b[2J.sbd', cannot be read (" in said


def test_a_message_that_cannot_be_judged_is_put_aside_too(tmp_path, monkeypatch):
    voyage = Voyage(tmp_path)
    ask = voyage.operator.ask

    async def faulty(wanted, number, way):
        if wanted.verb is Verb.HOME:
            raise AssertionError("a fault of ours")
        return await ask(wanted, number, way)

    monkeypatch.setattr(voyage.operator, "ask", faulty)
    status = voyage.sail(voyage.put(sealed(1, Verb.HOME), "0"), voyage.put(sealed(2)))
    assert (status.order, status.reply, voyage.waiting) == (2, Reply.DONE, [])
    assert put_aside(tmp_path) == ["0"]
    assert any("cannot be judged (AssertionError('a fault of ours'))" in text for text in voyage.said)


def test_what_cannot_even_be_put_aside_is_looked_at_no_more_and_what_is_kept_is_bounded(tmp_path):
    (tmp_path / ASIDE).write_text("in the way")
    voyage = Voyage(tmp_path)
    status = voyage.sail(lambda: unreadable("loop", tmp_path / IN / "0"), *[lambda: None] * TRIES, voyage.put(sealed()))
    assert (status.reply, voyage.waiting) == (Reply.DONE, ["0"])
    (tmp_path / ASIDE).unlink()
    flooded = Voyage(tmp_path)
    flooded.sail(lambda: [unreadable("loop", tmp_path / IN / f"a{n}") for n in range(30)], *[lambda: None] * 9)
    assert len(put_aside(tmp_path)) == MOST_ASIDE


def test_a_counter_far_ahead_closes_no_door(tmp_path):
    """After order 65535 no other was taken for ever."""
    voyage = Voyage(tmp_path)
    status = voyage.sail(voyage.put(sealed(65535)))
    assert (status.order, status.reply, voyage.orders) == (65535, Reply.AHEAD, [])
    assert voyage.sail(voyage.put(sealed(1))).reply is Reply.DONE


def test_the_shore_begins_anew_and_nothing_of_before_counts_again(tmp_path):
    """Where the door was closed, by the release before this one."""
    closed = {"format": 1, "key": KEY.name, "replies": {"65535": ["00", "done"]}}
    (tmp_path / TAKEN).write_text(json.dumps(closed))
    first = Voyage(tmp_path)
    old, (began, data) = sealed(70), beginning()
    status = first.sail(first.put(old), first.put(data))
    assert (status.order, status.reply, first.orders) == (None, Reply.BEGUN, [])
    second = Voyage(tmp_path)
    assert second.sail().reply is Reply.BEGUN, "it outlives a restart"
    new = sealed(key=KEY.since(began))
    status = second.sail(
        second.put(sealed(1, Verb.HOME)), second.put(old, "2"), second.put(data, "3"), second.put(new, "4")
    )
    assert (status.order, status.reply, [o.wanted.verb for o in second.orders]) == (1, Reply.DONE, [Verb.HOLD])
    assert second.sail(second.put(data), second.put(new, "n")).reply is Reply.DONE, "played back, it begins nothing"
    assert len(second.orders) == 1
    assert second.sail(second.put(beginning(ago_s=600.0)[1])).reply is Reply.OLD
