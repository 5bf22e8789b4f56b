"""Lists on the autopilot, message by message and outcome by outcome: no line, no simulation, a scripted other side."""

from __future__ import annotations

import asyncio
from dataclasses import dataclass, field, replace
from typing import Any

import pytest
from pymavlink.dialects.v20 import ardupilotmega as wire

from companion.mavlink.microservices.command import REASON_WAIT_S, Party, TransferOutcome
from companion.mavlink.microservices.ftp import MISSION_FILE, FtpRead, FtpResult, FtpWrite
from companion.mavlink.microservices.mission import DownloadResult, ListDownload, ListResult, ListUpload
from companion.mavlink.mission_lists import MissionLists, ReadResult, compared
from companion.mavlink.wire.codec import AutopilotVersion
from companion.mavlink.wire.frames import Codec
from companion.mavlink.wire.items import pack_mission_dat, padded
from companion.messages import AutopilotStatus, Command, GeoPoint, MissionItem, MissionState, MissionType

PARTY = Party(1, 1, 1, 191)
MISSION, FENCE = MissionType.MISSION, MissionType.FENCE
WAY = tuple(MissionItem(command=16, lat_e7=511_000_000 + n, lon_e7=-13_000_000) for n in range(3))
END = MissionItem(command=Command.NAV_LOITER_UNLIM, lat_e7=511_000_009, lon_e7=-13_000_000)
ITEMS = (*WAY, END)
OTHER = replace(WAY[0], lat_e7=500_000_000)


def from_autopilot(message, *, component=1):
    """A message as it is heard."""
    return Codec(1, 191).feed(Codec(1, component).pack(message))[0]


def ack(kind, *, to=191, mission_type=0, component=1):
    return from_autopilot(wire.MAVLink_mission_ack_message(1, to, kind, mission_type), component=component)


def request(seq, *, to=191, mission_type=0, is_int=True, component=1):
    make = wire.MAVLink_mission_request_int_message if is_int else wire.MAVLink_mission_request_message
    return from_autopilot(make(1, to, seq, mission_type), component=component)


def text(words):
    return from_autopilot(wire.MAVLink_statustext_message(4, words.encode()))


def count(n, *, mission_type=0, to=191):
    return from_autopilot(wire.MAVLink_mission_count_message(1, to, n, mission_type))


def sent_item(seq, item, *, mission_type=0, is_int=True, to=191, **changes):
    place = (item.lat_e7, item.lon_e7) if is_int else (item.lat_e7 / 1e7, item.lon_e7 / 1e7)
    make = wire.MAVLink_mission_item_int_message if is_int else wire.MAVLink_mission_item_message
    values = {"frame": item.frame, "command": item.command} | changes
    return from_autopilot(
        make(1, to, seq, values["frame"], values["command"], 0, 1, *item.params, *place, item.alt_m, mission_type)
    )


# --------------------------------------------------------------------------------------------------- an upload
@pytest.mark.parametrize("mission_type", [MISSION, FENCE])
def test_an_upload_is_offered_by_its_length_and_a_partial_one_by_its_ends(mission_type):
    (whole,) = ListUpload(PARTY, mission_type, ITEMS).start(0.0)
    assert (whole.get_type(), whole.count, whole.mission_type) == ("MISSION_COUNT", 4, int(mission_type))
    assert (whole.target_system, whole.target_component) == (1, 1)
    (part,) = ListUpload(PARTY, mission_type, ITEMS[1:3], first=2, partial=True).start(0.0)
    assert (part.get_type(), part.start_index, part.end_index) == ("MISSION_WRITE_PARTIAL_LIST", 2, 3)
    assert part.mission_type == int(mission_type)
    with pytest.raises(ValueError, match="needs items"):
        ListUpload(PARTY, mission_type, (), partial=True)
    assert ListUpload(PARTY, mission_type, ()).start(0.0)[0].count == 0


def begun(items=ITEMS, **more):
    machine = ListUpload(PARTY, MISSION, items, **more)
    machine.start(100.0)
    return machine


@pytest.mark.parametrize("is_int", [True, False])
def test_each_request_is_served_by_its_number(is_int):
    machine = begun(first=5)
    (message,) = machine.receive(101.0, request(6, is_int=is_int))
    assert (message.get_type(), message.seq, message.x) == ("MISSION_ITEM_INT", 6, ITEMS[1].lat_e7)
    assert machine.wake_s == 111.0  # ten seconds after the last item it is dead
    for seq in (4, 9):
        assert machine.receive(102.0, request(seq)) == []
    assert machine.wake_s == 111.0
    for seq in (5, 7, 8):
        machine.receive(103.0, request(seq))
    assert machine.wake_s == 108.0  # all are sent: a last acknowledgement is waited for


@pytest.mark.parametrize(
    "message",
    [request(0, to=7), request(0, mission_type=1), request(0, component=2), text("MISSION_REQUEST"), count(4)],
)
def test_what_is_not_for_this_upload_is_let_be(message):
    machine = begun()
    wake_s = machine.wake_s
    assert machine.receive(101.0, message) == []
    assert (machine.wake_s, machine.result) == (wake_s, None)


def test_an_offer_is_repeated_for_eight_seconds():
    machine = begun()
    first_s, offers = machine.wake_s, 0
    while machine.result is None:
        offers += len(machine.tick(machine.wake_s))
    assert first_s == pytest.approx(100.7)
    assert machine.wake_s == pytest.approx(108.0)
    assert 7 <= offers <= 10
    assert (machine.result.outcome, machine.result.ack) == (TransferOutcome.TIMEOUT, None)
    assert machine.result.text == "no answer to the offer of a list"


@pytest.mark.parametrize(
    ("seqs", "outcome", "words"),
    [
        ((0, 1), TransferOutcome.TIMEOUT, "stopped asking after 2 of 4 items"),
        ((0, 0, 1, 2), TransferOutcome.TIMEOUT, "stopped asking after 3 of 4 items"),
        ((0, 1, 2, 3), TransferOutcome.UNCONFIRMED, "no final acknowledgement"),
    ],
)
def test_an_autopilot_that_falls_silent(seqs, outcome, words):
    machine = begun()
    for seq in seqs:
        machine.receive(101.0, request(seq))
    assert machine.tick(machine.wake_s) == []
    assert machine.result.outcome is outcome
    assert words in machine.result.text


def served():
    machine = begun()
    for seq in range(4):
        machine.receive(101.0, request(seq))
    return machine


def test_it_is_done_when_it_is_accepted_with_all_items_sent_and_not_before():
    early = begun()
    early.receive(101.0, request(0))
    early.receive(101.0, ack(0))
    assert early.result is None
    machine = served()
    machine.receive(102.0, ack(0))
    assert machine.result == ListResult(outcome=TransferOutcome.OK, text="", ack=0)
    assert machine.receive(103.0, request(0)) == []  # it is over
    wrong = served()
    wrong.receive(102.0, ack(13))
    assert wrong.result is None
    assert wrong.wake_s == 106.0


@pytest.mark.parametrize("kind", [wire.MAV_MISSION_OPERATION_CANCELLED, wire.MAV_MISSION_DENIED])
def test_cancelled_it_is_offered_again_three_times(kind):
    machine = served()
    for n in range(3):
        assert machine.receive(110.0 + n, ack(kind)) == []
        assert machine.wake_s == 111.0 + n
        (offer,) = machine.tick(machine.wake_s)
        assert offer.get_type() == "MISSION_COUNT"
        assert machine.result is None
    machine.receive(120.0, ack(kind))
    machine.tick(machine.wake_s)
    assert (machine.result.outcome, machine.result.ack) == (TransferOutcome.REFUSED, kind)


def test_an_upload_that_was_cancelled_has_eight_seconds_again():
    machine = served()
    machine.receive(110.0, ack(wire.MAV_MISSION_DENIED))
    offers = 0
    while machine.result is None:
        offers += len(machine.tick(machine.wake_s))
    assert machine.wake_s == pytest.approx(118.0)
    assert offers >= 6


def test_a_refusal_waits_for_its_reason_and_hears_nothing_else():
    machine = served()
    assert machine.receive(102.0, ack(wire.MAV_MISSION_INVALID)) == []
    assert machine.wake_s == 102.0 + REASON_WAIT_S
    assert machine.receive(102.1, request(0)) == []
    assert machine.receive(102.1, text("Mission is too long")) == []
    machine.tick(machine.wake_s)
    assert machine.result.outcome is TransferOutcome.REFUSED
    assert machine.result.ack == wire.MAV_MISSION_INVALID
    assert machine.result.text == f"MISSION_ACK {wire.MAV_MISSION_INVALID} (invalid): Mission is too long"
    plain = served()
    plain.receive(102.0, ack(99))
    plain.tick(plain.wake_s)
    assert plain.result.text == "MISSION_ACK 99 (unknown)"


# --------------------------------------------------------------------------------------------------- a download
def asked(mission_type=MISSION):
    machine = ListDownload(PARTY, mission_type)
    (first,) = machine.start(100.0)
    assert (first.get_type(), first.mission_type) == ("MISSION_REQUEST_LIST", int(mission_type))
    assert machine.wake_s == pytest.approx(100.7)
    return machine


@pytest.mark.parametrize("mission_type", [MISSION, FENCE])
@pytest.mark.parametrize("is_int", [True, False])
def test_a_list_is_asked_for_item_after_item_and_acknowledged(mission_type, is_int):
    machine, kind = asked(mission_type), int(mission_type)
    (question,) = machine.receive(101.0, count(4, mission_type=kind))
    for seq, item in enumerate(ITEMS):
        assert (question.get_type(), question.seq, question.mission_type) == ("MISSION_REQUEST_INT", seq, kind)
        assert machine.receive(101.5, sent_item(seq + 1, item, mission_type=kind)) == []  # not what was asked for
        (question,) = machine.receive(102.0 + seq, sent_item(seq, item, mission_type=kind, is_int=is_int))
        assert machine.wake_s == pytest.approx(102.7 + seq)
    assert (question.get_type(), question.type, question.mission_type) == ("MISSION_ACK", 0, kind)
    assert machine.result.outcome is TransferOutcome.OK
    assert [item.command for item in machine.result.items] == [16, 16, 16, 17]
    for found, item in zip(machine.result.items, ITEMS, strict=True):
        assert abs(found.lat_e7 - item.lat_e7) <= (0 if is_int else 40)


def test_an_empty_list_is_one():
    machine = asked()
    (answer,) = machine.receive(101.0, count(0))
    assert answer.get_type() == "MISSION_ACK"
    assert machine.result == DownloadResult(outcome=TransferOutcome.OK)
    assert machine.receive(101.0, count(2)) == []


def test_a_list_that_changes_its_length_is_read_from_the_beginning():
    machine = asked()
    machine.receive(101.0, count(3))
    machine.receive(101.0, sent_item(0, WAY[0]))
    assert machine.receive(101.0, count(3)) == []  # an echo
    (question,) = machine.receive(101.0, count(2))
    assert question.seq == 0
    machine.receive(101.0, sent_item(0, OTHER))
    machine.receive(101.0, sent_item(1, END))
    assert [item.lat_e7 for item in machine.result.items] == [OTHER.lat_e7, END.lat_e7]


@pytest.mark.parametrize(
    "message", [count(2, to=7), count(2, mission_type=1), text("x"), sent_item(0, WAY[0]), request(0)]
)
def test_what_is_not_for_this_download_is_let_be(message):
    machine = asked()
    assert machine.receive(100.5, message) == []
    assert machine.wake_s == pytest.approx(100.7)
    (question,) = machine.tick(machine.wake_s)
    assert question.get_type() == "MISSION_REQUEST_LIST"


@pytest.mark.parametrize(("kind", "is_refused"), [(0, False), (13, False), (3, True), (1, True)])
def test_a_list_is_refused_only_before_it_is_told(kind, is_refused):
    machine = asked()
    machine.receive(100.2, text("no such list"))
    machine.receive(100.5, ack(kind))
    assert (machine.result is not None) is is_refused
    if is_refused:
        assert machine.result.outcome is TransferOutcome.REFUSED
        assert machine.result.text.startswith(f"MISSION_ACK {kind} (")
        assert machine.result.text.endswith(") no such list")
    told = asked()
    told.receive(100.5, count(2))
    told.receive(100.6, ack(kind))
    assert told.result is None


def test_an_item_that_is_none_ends_it():
    machine = asked()
    machine.receive(101.0, count(1))
    bad = replace(WAY[0])
    object.__setattr__(bad, "lat_e7", 1_000_000_000)
    machine.receive(101.0, sent_item(0, bad))
    assert machine.result.outcome is TransferOutcome.MISMATCH
    assert machine.result.text.startswith("item 0: ")


@pytest.mark.parametrize(
    ("heard", "words"), [((), "no answer to the request of a list"), ((count(2), sent_item(0, WAY[0])), "item 1 of 2")]
)
def test_a_download_gives_up_after_twelve_seconds(heard, words):
    machine = asked()
    for message in heard:
        machine.receive(100.0, message)
    questions = 0
    while machine.result is None:
        questions += len(machine.tick(machine.wake_s))
    assert machine.wake_s == pytest.approx(112.0)
    assert questions > 8
    assert machine.result.outcome is TransferOutcome.TIMEOUT
    assert words in machine.result.text


# ----------------------------------------------------------------------------------- what is done with the machines
@dataclass
class Side:
    """The autopilot's side of ``perform``: what each kind of machine ends with, in order; the last one stays."""

    script: dict[type, list[Any]] = field(default_factory=dict)
    lost_after: int = 10**9
    party: Party = PARTY
    seen: list[Any] = field(default_factory=list)

    @property
    def is_lost(self):
        return len(self.seen) >= self.lost_after

    def lock(self, _name):
        return Held()

    async def perform(self, machine):
        self.seen.append(machine)
        answers = self.script[type(machine)]
        return answers.pop(0) if len(answers) > 1 else answers[0]

    @property
    def names(self):
        return [
            ("partial" if machine._partial else "upload") if isinstance(machine, ListUpload) else type(machine).__name__
            for machine in self.seen
        ]


class Held:
    async def __aenter__(self):
        return None

    async def __aexit__(self, *_):
        return None


HOME = MissionItem(command=16)
VERSION = AutopilotVersion(version=(4, 6, 0), capabilities=0, uid="5a")


def listed(outcome=TransferOutcome.OK, **more):
    return ListResult(outcome=outcome, **more)


def back(*items, outcome=TransferOutcome.OK, **more):
    """What is read back of a mission: home is its first item."""
    return DownloadResult(outcome=outcome, items=(HOME, *items), **more)


def written(outcome=TransferOutcome.OK, **more):
    return FtpResult(outcome=outcome, next_seq=77, **more)


def lists(side, *, total=None, armed=False, state=MissionState.ACTIVE, has_ftp=None, home=None):
    status = AutopilotStatus(t_s=0.0, mission_total=total, is_armed=armed, mission_state=state)
    made = MissionLists(side, lambda: status)
    if has_ftp is not None:
        made.version = replace(VERSION, capabilities=wire.MAV_PROTOCOL_CAPABILITY_FTP if has_ftp else 0)
    made.home = home
    return made


def put(side, items=ITEMS, *, method="auto", keep=0, stopgap=None, **more):
    return asyncio.run(lists(side, **more).write_mission(items, method, keep, stopgap))


OK, TIMEOUT, REFUSED = TransferOutcome.OK, TransferOutcome.TIMEOUT, TransferOutcome.REFUSED
UNCONFIRMED, UNSUPPORTED, MISMATCH = (
    TransferOutcome.UNCONFIRMED,
    TransferOutcome.UNSUPPORTED,
    TransferOutcome.MISMATCH,
)
PLAIN = ["upload", "ListDownload"]


@pytest.mark.parametrize(
    ("uploads", "reads", "outcome", "names"),
    [
        ([listed()], [back(*ITEMS)], OK, PLAIN),
        ([listed(UNCONFIRMED)], [back(*ITEMS)], OK, PLAIN),  # the read-back tells
        ([listed(TIMEOUT), listed()], [back(*ITEMS)], OK, ["upload", *PLAIN]),
        ([listed(TIMEOUT)], [back(*ITEMS)], TIMEOUT, ["upload", "upload"]),
        ([listed(REFUSED)], [back(*ITEMS)], REFUSED, ["upload"]),  # no is no
        ([listed()], [back(*WAY), back(*ITEMS)], OK, [*PLAIN, *PLAIN]),
        ([listed()], [back(OTHER, *ITEMS[1:])], MISMATCH, [*PLAIN, *PLAIN]),
        ([listed()], [back(outcome=TIMEOUT)], TIMEOUT, [*PLAIN, *PLAIN]),
    ],
)
def test_items_are_written_and_read_back_twice_at_most(uploads, reads, outcome, names):
    side = Side({ListUpload: uploads, ListDownload: reads})
    result = put(side, method="items")
    assert (result.outcome, result.method, side.names) == (outcome, "items", names)
    assert result.count == (len(ITEMS) if outcome in {OK, MISMATCH} else None)
    whole = side.seen[0]
    assert [whole._items[n].lat_e7 for n in range(5)] == [ITEMS[0].lat_e7, *(item.lat_e7 for item in ITEMS)]


def test_what_stands_behind_the_end_is_told_and_what_is_missing_is_a_mismatch():
    longer = put(Side({ListUpload: [listed()], ListDownload: [back(*ITEMS, OTHER, OTHER)]}), method="items")
    assert (longer.outcome, longer.text, longer.count) == (OK, "2 old items stand behind the end", 6)
    same = put(Side({ListUpload: [listed()], ListDownload: [back(*ITEMS)]}), method="items")
    assert same.text == ""
    behind = (*ITEMS, OTHER)  # what is behind the end is never sailed, and yet must be there
    shorter = put(Side({ListUpload: [listed()], ListDownload: [back(*ITEMS)]}), behind, method="items")
    assert (shorter.outcome, shorter.text) == (MISMATCH, "5 items written, 4 read back")
    unread = put(Side({ListUpload: [listed()], ListDownload: [back(outcome=TIMEOUT, text="silence")]}), method="items")
    assert unread.text == "written, not read back: silence"


@pytest.mark.parametrize("lost_after", [0, 1, 2])
def test_on_a_dead_link_nothing_is_tried_again(lost_after):
    side = Side({ListUpload: [listed(TIMEOUT)], ListDownload: [back(outcome=TIMEOUT)]}, lost_after=lost_after)
    result = put(side, method="items")
    assert result.outcome is TransferOutcome.LINK
    assert len(side.seen) == max(1, lost_after)
    read = Side({ListUpload: [listed()], ListDownload: [back(outcome=TIMEOUT)]}, lost_after=2)
    assert put(read, method="items").outcome is TransferOutcome.LINK


@pytest.mark.parametrize(
    ("method", "more", "ways"),
    [
        ("items", {}, ("items", "items")),
        ("ftp", {}, ("ftp", "ftp")),
        ("auto", {}, ("ftp", "ftp", "items", "items")),
        ("auto", {"has_ftp": True}, ("ftp", "ftp", "items", "items")),
        ("auto", {"has_ftp": False}, ("items", "items")),
        ("auto", {"is_guarded": True}, ("ftp", "ftp", "guarded", "guarded", "items")),
        ("auto", {"is_guarded": True, "has_ftp": False}, ("guarded", "guarded", "items")),
        ("auto", {"has_ftp": False, "keep": 2, "total": 4}, ("partial", "items", "items")),
        ("auto", {"has_ftp": False, "keep": 2, "total": 3}, ("partial", "items", "items")),  # one longer at most
        ("auto", {"has_ftp": False, "keep": 2, "total": 2}, ("items", "items")),
        ("auto", {"has_ftp": False, "keep": 0, "total": 4}, ("items", "items")),
        ("auto", {"has_ftp": False, "keep": 1, "total": 4}, ("partial", "items", "items")),
        ("auto", {"has_ftp": False, "keep": 4, "total": 4}, ("items", "items")),
        ("auto", {"has_ftp": False, "keep": 2, "total": None}, ("items", "items")),
        ("auto", {"has_ftp": False, "keep": 2, "total": 4, "items": WAY}, ("items", "items")),  # it has no end
        ("auto", {"has_ftp": False, "keep": 2, "total": 4, "items": ()}, ("items", "items")),
    ],
)
def test_which_protocols_are_tried_in_which_order(method, more, ways):
    more = dict(more)
    items, keep, guarded = more.pop("items", ITEMS), more.pop("keep", 0), more.pop("is_guarded", False)
    assert lists(Side(), **more)._ways(items, method, keep, is_guarded=guarded) == ways


def test_an_autopilot_that_was_not_heard_has_no_total():
    made = MissionLists(Side(), lambda: None)
    assert (made._mission_total(), made._running_total()) == (None, 0)


@pytest.mark.parametrize(
    ("armed", "state", "total", "left"),
    [
        (True, MissionState.ACTIVE, 9, 9),
        (False, MissionState.ACTIVE, 9, 0),
        (True, MissionState.NO_MISSION, 9, 0),
        (True, MissionState.ACTIVE, None, 0),
    ],
)
def test_what_a_write_without_clearing_leaves(armed, state, total, left):
    assert lists(Side(), armed=armed, state=state, total=total)._running_total() == left


@pytest.mark.parametrize(("total", "length"), [(9, 9), (2, 4), (None, 4)])
def test_a_file_is_padded_over_what_is_under_way_and_read_back_as_a_file(total, length):
    sent = padded(ITEMS, length)
    read = written(data=pack_mission_dat((HOME, *sent), MISSION))
    side = Side({FtpWrite: [written()], FtpRead: [read]})
    result = put(side, total=total, armed=True, home=GeoPoint(lat_deg=50.0, lon_deg=-1.0))
    assert (result.outcome, result.method, result.count, side.names) == (OK, "ftp", length, ["FtpWrite", "FtpRead"])
    home = MissionItem(command=16, lat_e7=500_000_000, lon_e7=-10_000_000, frame=0)
    assert side.seen[0]._data == pack_mission_dat((home, *sent), MISSION)
    assert side.seen[0]._path == MISSION_FILE.encode()
    assert side.seen[1]._seq == 77  # the number goes on where the write ended


@pytest.mark.parametrize(
    ("outcome", "names", "again"),
    [
        (UNSUPPORTED, ["FtpWrite", *PLAIN], PLAIN),  # never asked for again
        (REFUSED, ["FtpWrite", *PLAIN], PLAIN),
        (TIMEOUT, ["FtpWrite", "FtpWrite", *PLAIN], ["FtpWrite", "FtpWrite", *PLAIN]),
    ],
)
def test_an_autopilot_without_files_is_written_item_by_item(outcome, names, again):
    side = Side({FtpWrite: [written(outcome)], ListUpload: [listed()], ListDownload: [back(*ITEMS)]})
    made = lists(side)
    assert asyncio.run(made.write_mission(ITEMS, "auto", 0, None)).is_ok
    assert side.names == names
    side.seen.clear()
    assert asyncio.run(made.write_mission(ITEMS, "auto", 0, None)).is_ok
    assert side.names == again


def test_files_that_worked_once_are_not_given_up_for_a_refusal():
    read = written(data=pack_mission_dat((HOME, *ITEMS), MISSION))
    side = Side(
        {FtpWrite: [written(), written(REFUSED)], FtpRead: [read], ListUpload: [listed()], ListDownload: [back(*ITEMS)]}
    )
    made = lists(side)
    for _ in range(3):
        assert asyncio.run(made.write_mission(ITEMS, "auto", 0, None)).is_ok
    assert side.names == ["FtpWrite", "FtpRead", *(["FtpWrite", "FtpWrite", *PLAIN] * 2)]


@pytest.mark.parametrize(
    ("read", "words"),
    [
        (written(TIMEOUT), ""),
        (written(data=b"no mission"), ""),
        (written(data=pack_mission_dat((HOME, *ITEMS), FENCE)), ""),
        (written(data=pack_mission_dat((HOME, *ITEMS), MISSION, start=1)), ""),
    ],
)
def test_a_file_that_cannot_be_read_back_is_read_item_by_item(read, words):
    side = Side({FtpWrite: [written()], FtpRead: [read], ListDownload: [back(*ITEMS)]})
    assert put(side).is_ok
    assert side.names == ["FtpWrite", "FtpRead", "ListDownload"]
    alone = Side({FtpRead: [read]}, lost_after=1)
    found = asyncio.run(lists(alone).read(MISSION, "ftp"))
    assert found.items is None
    assert found.outcome in {TIMEOUT, MISMATCH}
    assert words in found.text


# ------------------------------------------------------------------------------------- part of a list, and guarded
def test_only_what_follows_is_written_in_part():
    side = Side({ListUpload: [listed()], ListDownload: [back(*ITEMS)]})
    result = put(side, has_ftp=False, keep=2, total=4)
    assert (result.outcome, result.method, side.names) == (OK, "partial", ["partial", "ListDownload"])
    assert side.seen[0]._items == {3: ITEMS[2], 4: ITEMS[3]}
    failed = Side({ListUpload: [listed(REFUSED), listed()], ListDownload: [back(*ITEMS)]})
    assert put(failed, has_ftp=False, keep=2, total=4).method == "items"
    assert failed.names == ["partial", *PLAIN]


GAP = MissionItem(command=Command.NAV_LOITER_UNLIM, lat_e7=511_000_000, lon_e7=-13_000_000)
CLOSED = (ITEMS[0], GAP, *ITEMS[2:])


def guarded(uploads, reads, *, keep=1, total=4, items=ITEMS, **more):
    side = Side({ListUpload: uploads, ListDownload: reads}, **more)
    result = put(side, items, has_ftp=False, keep=keep, total=total, stopgap=GAP)
    return result, side


def test_behind_a_stopgap_the_rest_is_written_and_checked_and_then_opened():
    result, side = guarded([listed()], [back(*CLOSED), back(*ITEMS)])
    assert (result.outcome, result.method, result.count) == (OK, "guarded", 4)
    assert side.names == ["partial", "partial", "ListDownload", "partial", "ListDownload"]
    assert [m._items for m in side.seen if isinstance(m, ListUpload)] == [
        {2: GAP},
        {3: ITEMS[2], 4: ITEMS[3]},
        {2: ITEMS[1]},
    ]


@pytest.mark.parametrize(("total", "is_whole"), [(3, False), (2, True), (None, True)])
def test_a_list_that_grows_by_more_than_one_is_written_whole_behind_the_stopgap(total, is_whole):
    result, side = guarded([listed()], [back(*CLOSED), back(*ITEMS)], total=total)
    assert result.is_ok
    assert side.names[1] == ("upload" if is_whole else "partial")
    if is_whole:
        assert [item.lat_e7 for item in side.seen[1]._items.values()][1:] == [item.lat_e7 for item in CLOSED]


def test_a_refused_part_is_written_whole():
    result, side = guarded([listed(), listed(REFUSED), listed()], [back(*CLOSED), back(*ITEMS)])
    assert result.is_ok
    assert side.names[:3] == ["partial", "partial", "upload"]


def test_the_last_item_alone_needs_no_stopgap():
    result, side = guarded([listed()], [back(*ITEMS)], keep=3)
    assert result.is_ok
    assert side.names == ["partial", "ListDownload"]
    assert side.seen[0]._items == {4: ITEMS[3]}


@pytest.mark.parametrize(
    ("uploads", "reads", "outcome"),
    [
        ([listed(TIMEOUT)], [back()], TIMEOUT),
        ([listed(UNCONFIRMED)], [back()], TIMEOUT),  # it may not stand there: nothing is written behind it
        ([listed(), listed(TIMEOUT)] * 2, [back()], TIMEOUT),
        ([listed(), listed()] * 3, [back(*ITEMS)], MISMATCH),
        ([listed(), listed()] * 3, [back(*CLOSED[:3])], MISMATCH),
        ([listed(), listed()] * 3, [back(outcome=REFUSED)], REFUSED),
    ],
)
def test_what_fails_behind_a_stopgap_is_not_tried_again_without(uploads, reads, outcome):
    result, side = guarded(list(uploads), list(reads))
    assert (result.outcome, result.method) == (outcome, "guarded")
    assert "upload" not in side.names


def test_the_opening_item_is_judged_by_what_is_read_back():
    result, _ = guarded([listed()], [back(*CLOSED), back(*CLOSED)])
    assert (result.outcome, result.count) == (MISMATCH, 4)
    result, _ = guarded([listed()], [back(*CLOSED), back(outcome=TIMEOUT, text="silence")])
    assert (result.outcome, result.text) == (TIMEOUT, "written, not read back: silence")
    result, _ = guarded([listed(), listed(), listed(REFUSED)] * 2, [back(*CLOSED)])
    assert result.outcome is REFUSED


def test_an_autopilot_that_knows_no_partial_write_is_written_whole():
    unknown = listed(REFUSED, ack=wire.MAV_MISSION_UNSUPPORTED)
    result, side = guarded([unknown, unknown, listed()], [back(*ITEMS)])
    assert (result.outcome, result.method) == (OK, "items")
    assert side.names == ["partial", "partial", *PLAIN]
    refused, side = guarded([listed(REFUSED, ack=wire.MAV_MISSION_DENIED)], [back(*ITEMS)])
    assert (refused.outcome, side.names) == (REFUSED, ["partial", "partial"])


def test_a_guarded_write_on_a_dead_link_says_so():
    result, side = guarded([listed(TIMEOUT)], [back()], lost_after=1)
    assert (result.outcome, len(side.seen)) == (TransferOutcome.LINK, 1)


# --------------------------------------------------------------------------------------------- fences and the rest
@pytest.mark.parametrize(
    ("uploads", "reads", "outcome", "names"),
    [
        ([listed()], [DownloadResult(outcome=OK, items=ITEMS)], OK, PLAIN),
        ([listed(UNCONFIRMED)], [DownloadResult(outcome=OK, items=ITEMS)], OK, PLAIN),
        ([listed(TIMEOUT)], [DownloadResult(outcome=OK, items=ITEMS)], TIMEOUT, ["upload", "upload"]),
        ([listed(REFUSED)], [DownloadResult(outcome=OK, items=ITEMS)], REFUSED, ["upload"]),
        ([listed()], [DownloadResult(outcome=OK, items=WAY)], MISMATCH, [*PLAIN, *PLAIN]),
        ([listed()], [DownloadResult(outcome=REFUSED)], REFUSED, PLAIN),
    ],
)
def test_a_fence_is_written_and_read_back(uploads, reads, outcome, names):
    side = Side({ListUpload: uploads, ListDownload: reads})
    result = asyncio.run(lists(side).write(FENCE, ITEMS))
    assert (result.outcome, result.method, side.names) == (outcome, "items", names)
    assert result.duration_s >= 0.0
    assert dict(side.seen[0]._items) == dict(enumerate(ITEMS))  # a fence has no home
    lost = Side({ListUpload: [listed(TIMEOUT)], ListDownload: [back()]}, lost_after=1)
    assert asyncio.run(lists(lost).write(FENCE, ITEMS)).outcome is TransferOutcome.LINK
    assert len(lost.seen) == 1


def test_what_is_read_is_without_home_where_there_is_one():
    side = Side({ListDownload: [back(*ITEMS)]})
    mission, fence = (asyncio.run(lists(side).read(kind, "items")) for kind in (MISSION, FENCE))
    assert (mission.items, mission.home) == (ITEMS, HOME)
    assert (fence.items, fence.home) == ((HOME, *ITEMS), None)
    empty = asyncio.run(lists(Side({ListDownload: [DownloadResult(outcome=OK)]})).read(MISSION, "items"))
    assert (empty.items, empty.home) == ((), None)
    lost = asyncio.run(lists(Side({ListDownload: [back(outcome=TIMEOUT)]}, lost_after=1)).read(MISSION, "items"))
    assert (lost.outcome, lost.items) == (TransferOutcome.LINK, None)
    no = asyncio.run(lists(Side({ListDownload: [back(outcome=REFUSED, text="no")]})).read(MISSION, "items"))
    assert (no.outcome, no.text, no.items) == (REFUSED, "no", None)


def test_what_is_compared():
    assert compared(ITEMS, ReadResult(outcome=TIMEOUT, text="x"), "items").outcome is TIMEOUT
    same = compared(ITEMS, ReadResult(outcome=OK, items=ITEMS), "items")
    assert (same.outcome, same.count, same.text) == (OK, 4, "")
    other = compared(ITEMS, ReadResult(outcome=OK, items=WAY), "items")
    assert (other.outcome, other.count) == (MISMATCH, 3)
