"""The step machines relive recorded conversations with ArduRover and must say what the recorded client said."""

import pytest

from companion.mavlink.microservices.command import CommandSend, TransferOutcome
from companion.mavlink.microservices.ftp import MISSION_FILE, FtpRead, FtpWrite, unpack
from companion.mavlink.microservices.mission import ListDownload, ListUpload
from companion.mavlink.microservices.parameters import ParamRead, ParamSet
from companion.mavlink.wire.codec import mission_item
from companion.mavlink.wire.items import first_difference, pack_mission_dat, unpack_mission_dat
from companion.messages import MissionType
from tests.mavlink.golden import PARTY, between, fields, load, relive, said


def items_of(messages):
    """Return the items that the recorded client sent, by their number (the last one of each)."""
    found = {m.seq: mission_item(m) for m in said(messages, 191) if m.get_type() == "MISSION_ITEM_INT"}
    return [found[i] for i in sorted(found)]


def client(messages, *kinds):
    return [fields(m) for m in said(messages, 191) if m.get_type() in kinds]


def test_mission_upload_and_download_say_what_the_recorded_client_said():
    talk = load("mission_upload_download")
    split_s = next(t for t, m in talk if m.get_type() == "MISSION_REQUEST_LIST")
    upload, download = between(talk, 0.0, split_s - 1e-6), between(talk, split_s, 1e9)
    items = items_of(upload)
    assert len(items) == 7
    machine = ListUpload(PARTY, MissionType.MISSION, items)
    sent = relive(machine, upload)
    assert machine.result.outcome is TransferOutcome.OK
    assert [fields(m) for m in sent] == client(upload, "MISSION_COUNT", "MISSION_ITEM_INT")

    reader = ListDownload(PARTY, MissionType.MISSION)
    sent = relive(reader, download)
    assert reader.result.outcome is TransferOutcome.OK
    assert [fields(m) for m in sent] == [fields(m) for m in said(download, 191)]
    assert first_difference(items[1:], reader.result.items[1:]) == ""
    assert reader.result.items[0].frame == 0, "item 0 comes back as the live home"


def test_partial_write_sends_only_its_items():
    talk = load("partial_write")
    items = items_of(talk)
    machine = ListUpload(PARTY, MissionType.MISSION, items, first=4, partial=True)
    sent = relive(machine, talk)
    assert machine.result.outcome is TransferOutcome.OK
    assert [fields(m) for m in sent] == client(talk, "MISSION_WRITE_PARTIAL_LIST", "MISSION_ITEM_INT")


def test_ack_13_does_not_end_an_upload():
    talk = load("upload_wrong_item")
    items = items_of(talk)
    machine = ListUpload(PARTY, MissionType.MISSION, items)
    sent = relive(machine, talk)
    assert machine.result.outcome is TransferOutcome.OK
    assert [m.seq for m in sent if m.get_type() == "MISSION_ITEM_INT"] == [0, 1, 2, 3, 4, 5, 6]
    assert 13 in [m.type for m in said(talk, 1) if m.get_type() == "MISSION_ACK"]


def test_a_cancelled_upload_is_offered_again():
    talk = load("upload_left_alone")
    items = [*items_of(talk), *items_of(talk)[:3]]
    machine = ListUpload(PARTY, MissionType.MISSION, items)
    sent = relive(machine, talk)
    counts = [i for i, m in enumerate(sent) if m.get_type() == "MISSION_COUNT"]
    assert len(counts) >= 2, "after ACK 15 the list is offered once more"
    asked = [m.seq for m in said(talk, 1) if m.get_type() == "MISSION_REQUEST"]
    assert [m.seq for m in sent[1 : counts[1]]] == asked, "each repeated request is answered"
    assert machine.result.outcome is TransferOutcome.TIMEOUT, "the recording has no second upload"


@pytest.mark.parametrize(
    ("low_s", "high_s", "ack", "words"),
    [
        (0.0435, 2.0, 4, "Only 655 items are supported"),
        (2.0431, 10.0, 3, "unsupported"),
        (11.8, 12.0, 2, "unsupported frame"),
        (22.0, 23.0, 10, "invalid param5 x"),
    ],
)
def test_refusals_carry_the_reason(low_s, high_s, ack, words):
    talk = between(load("upload_refused_items"), low_s, high_s)
    first = said(talk, 191)[0]
    assert first.get_type() == "MISSION_COUNT"
    good = items_of(load("mission_upload_download"))
    machine = ListUpload(PARTY, MissionType.MISSION, [good[1]] * first.count)
    sent = relive(machine, talk)
    assert fields(sent[0]) == fields(first)
    assert machine.result.outcome is TransferOutcome.REFUSED
    assert machine.result.ack == ack
    assert words in machine.result.text
    assert "Field Elevation" not in machine.result.text


def test_fence_upload_and_its_refusals():
    talk = load("fence_upload_refusals")
    offers = [t for t, m in talk if m.get_type() == "MISSION_COUNT" and m.get_srcComponent() == 191]
    good = between(talk, offers[0], offers[1] - 1e-6)
    bad = between(talk, offers[1], offers[2] - 3.0)
    many = between(talk, offers[2], 1e9)
    items = [i for i in items_of(good) if i.command >= 5000]
    machine = ListUpload(PARTY, MissionType.FENCE, items)
    sent = relive(machine, good)
    assert machine.result.outcome is TransferOutcome.OK
    assert [fields(m) for m in sent] == client(good, "MISSION_COUNT", "MISSION_ITEM_INT")[:11]

    machine = ListUpload(PARTY, MissionType.FENCE, items_of(bad))
    relive(machine, bad)
    assert machine.result.outcome is TransferOutcome.REFUSED
    assert "Incorrect item count; Fence validation failed" in machine.result.text

    machine = ListUpload(PARTY, MissionType.FENCE, items[:1] * 85)
    relive(machine, many)
    assert machine.result.outcome is TransferOutcome.REFUSED
    assert "Only 84 items are supported" in machine.result.text


def test_ftp_write_and_read_are_the_recorded_bytes():
    talk = load("ftp_write_read")
    split_s = next(t for t, m in talk if m.get_srcComponent() == 191 and unpack(m.payload).opcode == 4)
    write, read = between(talk, 0.0, split_s - 1e-6), between(talk, split_s, 1e9)
    data = b"".join(unpack(m.payload).data for m in said(write, 191) if unpack(m.payload).opcode == 7)
    kind, start, items = unpack_mission_dat(data)
    assert (kind, start, len(items), len(data)) == (MissionType.MISSION, 0, 30, 1150)
    assert pack_mission_dat(items, kind) == data

    machine = FtpWrite(PARTY, MISSION_FILE, data, seq=1)
    sent = relive(machine, write)
    assert machine.result.outcome is TransferOutcome.OK
    assert [m.payload for m in sent] == [m.payload for m in said(write, 191)]

    reader = FtpRead(PARTY, MISSION_FILE, seq=unpack(said(read, 191)[0].payload).seq)
    sent = relive(reader, read)
    assert reader.result.outcome is TransferOutcome.OK
    assert [m.payload for m in sent] == [m.payload for m in said(read, 191)]
    back = unpack_mission_dat(reader.result.data)[2]
    assert first_difference(items[1:], back[1:]) == ""


def test_ftp_of_a_missing_file_is_unsupported():
    talk = load("ftp_not_found")
    machine = FtpRead(PARTY, "@MISSION/none.dat", seq=unpack(said(talk, 191)[0].payload).seq)
    relive(machine, talk)
    assert machine.result.outcome is TransferOutcome.UNSUPPORTED
    assert "file not found" in machine.result.text


@pytest.mark.parametrize(
    ("command", "params", "nth", "outcome", "words"),
    [
        (176, (1.0, 10.0), 0, TransferOutcome.REFUSED, "No Mission. Can't set AUTO.; Flight mode change failed"),
        (176, (1.0, 10.0), 1, TransferOutcome.OK, ""),
        (400, (1.0,), 0, TransferOutcome.REFUSED, "Arm: Accels inconsistent; Arm: AHRS: waiting for home"),
        (193, (), 0, TransferOutcome.UNSUPPORTED, ""),
    ],
)
def test_commands_with_the_autopilots_words(command, params, nth, outcome, words):
    talk = load("commands_refused")
    starts = [t for t, m in talk if m.get_type() == "COMMAND_LONG" and m.command == command]
    part = between(talk, starts[nth], starts[nth] + 0.1)
    machine = CommandSend(PARTY, command, params)
    sent = relive(machine, part)
    assert fields(sent[0]) == fields(next(m for _, m in part if m.get_type() == "COMMAND_LONG"))
    assert machine.result.outcome is outcome
    if words:
        assert machine.result.text == words


def test_parameters():
    talk = load("parameter_reads")
    asked_s = next(t for t, m in talk if getattr(m, "param_id", "") == "WP_RADIUS")
    machine = ParamRead(PARTY, ["WP_RADIUS"])
    relive(machine, between(talk, asked_s, asked_s + 0.15))
    assert (machine.result.outcome, machine.result.value) == (TransferOutcome.OK, 3.0)

    machine = ParamRead(PARTY, ["NO_SUCH_PARAM"])
    relive(machine, between(talk, 0.2045, 9.0))
    assert machine.result.outcome is TransferOutcome.TIMEOUT

    machine = ParamSet(PARTY, "SAIL_XTRACK_MAX", 30.0)
    relive(machine, between(talk, 1.3, 1.345))
    assert (machine.result.outcome, machine.result.value) == (TransferOutcome.OK, 30.0)

    machine = ParamSet(PARTY, "SAIL_XTRACK_MAX", 25.0)
    relive(machine, between(talk, 1.3, 1.345))
    assert machine.result.outcome is TransferOutcome.REFUSED, "the echo shows another value"
    assert "stays 30" in machine.result.text
