"""Retries end, streams are judged, keys are kept, and lossy peers are survived."""

import random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pymavlink.dialects.v20 import ardupilotmega as wire

from companion.errors import InputError
from companion.mavlink.microservices.command import Party, Retransmission, TransferOutcome
from companion.mavlink.microservices.ftp import FtpRead, FtpWrite, Packet, unpack
from companion.mavlink.microservices.mission import ListDownload, ListUpload
from companion.mavlink.microservices.parameters import ALIASES, ParamList, names_of
from companion.mavlink.signing import AHEAD_S, EPOCH_S, TICKS_PER_S, SigningStore, read_key
from companion.mavlink.wire.codec import heartbeat
from companion.mavlink.wire.frames import Codec, SigningState
from companion.mavlink.wire.streams import Stream, StreamMonitor
from companion.messages import MissionItem, MissionType

PARTY = Party(1, 1, 1, 191)


@settings(max_examples=200)
@given(st.floats(0.0, 1e7), st.floats(0.01, 3.0), st.floats(0.5, 30.0))
def test_a_retry_ends_at_any_time_of_day(start_s, first_s, give_up_s):
    retry = Retransmission(first_s=first_s, give_up_s=give_up_s)
    retry.progress(start_s)
    for _ in range(10_000):
        now_s = retry.wake_s
        if not retry.again(now_s):
            break
        assert retry.wake_s >= now_s
    else:
        pytest.fail("it never gives up")
    assert now_s >= start_s + give_up_s or now_s == pytest.approx(start_s + max(first_s, give_up_s))


class LossyPeer:
    """ArduRover's side of the list protocol behind a line that loses, doubles and reorders."""

    def __init__(self, rng, loss, items=()):
        self.rng, self.loss = rng, loss
        self.items, self.stored = list(items), None
        self.wanted, self.next, self.repeat_s = 0, None, None
        self.out, self.back = Codec(1, 1), Codec(1, 191)

    def answer(self, message, t_s):
        kind, ours = message.get_type(), wire
        if kind == "MISSION_COUNT":
            self.stored, self.wanted, self.next = {}, message.count, 0
        elif kind == "MISSION_ITEM_INT" and self.next is not None:
            if message.seq != self.next:
                return [ours.MAVLink_mission_ack_message(1, 191, 13, message.mission_type)]
            self.stored[self.next] = message
            self.next += 1
            if self.next == self.wanted:
                self.next = self.repeat_s = None
                return [ours.MAVLink_mission_ack_message(1, 191, 0, message.mission_type)]
        elif kind == "MISSION_REQUEST_LIST":
            return [ours.MAVLink_mission_count_message(1, 191, len(self.items), message.mission_type)]
        elif kind == "MISSION_REQUEST_INT":
            item = self.items[message.seq]
            return [
                ours.MAVLink_mission_item_int_message(
                    1, 191, message.seq, item.frame, item.command, 0, 1, *item.params, item.lat_e7, item.lon_e7, 0.0, 0
                )
            ]
        if self.next is None:
            return []
        self.repeat_s = t_s + 1.0
        return [ours.MAVLink_mission_request_message(1, 191, self.next, message.mission_type)]

    def line(self, messages):
        """Return what of ``messages`` arrives, and in which order."""
        arrived = []
        for message in messages:
            if self.rng.random() >= self.loss:
                arrived += [message] * (2 if self.rng.random() < 0.2 else 1)
        if self.rng.random() < 0.3:
            self.rng.shuffle(arrived)
        return arrived

    def talk(self, machine):
        t_s, to_peer = 0.0, machine.start(0.0)
        for _ in range(4000):
            if machine.result is not None:
                return
            received = [m for s in self.line(to_peer) for m in Codec(1, 1).feed(self.back.pack(s))]
            answers = [a for m in received for a in self.answer(m, t_s)]
            to_peer = []
            for message in self.line(answers):
                to_peer += machine.receive(t_s, Codec(1, 191).feed(self.out.pack(message))[0])
            if to_peer or machine.result is not None:
                t_s += 0.02
                continue
            t_s = min(machine.wake_s, self.repeat_s if self.repeat_s is not None else 1e9)
            if self.repeat_s is not None and t_s >= self.repeat_s:
                self.repeat_s = t_s + 1.0
                request = wire.MAVLink_mission_request_message(1, 191, self.next, 0)
                for message in self.line([request]):
                    to_peer += machine.receive(t_s, Codec(1, 191).feed(self.out.pack(message))[0])
            else:
                to_peer = machine.tick(machine.wake_s)
        pytest.fail("the conversation never ends")


ITEMS = [MissionItem(command=16, lat_e7=511000000 + i, lon_e7=-13000000) for i in range(12)]


@pytest.mark.parametrize("seed", range(30))
def test_an_upload_over_a_bad_line_ends_complete_or_says_why(seed):
    peer = LossyPeer(random.Random(seed), 0.3)
    machine = ListUpload(PARTY, MissionType.MISSION, ITEMS)
    peer.talk(machine)
    if machine.result.outcome is TransferOutcome.OK:
        assert [peer.stored[i].x for i in range(12)] == [i.lat_e7 for i in ITEMS]
    else:
        assert machine.result.outcome in {TransferOutcome.TIMEOUT, TransferOutcome.UNCONFIRMED}
        assert machine.result.text


def test_uploads_over_a_bad_line_mostly_succeed():
    good = 0
    for seed in range(30):
        machine = ListUpload(PARTY, MissionType.MISSION, ITEMS)
        LossyPeer(random.Random(seed), 0.3).talk(machine)
        good += machine.result.outcome is TransferOutcome.OK
    # a last acknowledgement lost is a success that only a reading back can tell
    assert good >= 15


@pytest.mark.parametrize("seed", range(30))
def test_a_download_over_a_bad_line_is_exact(seed):
    peer = LossyPeer(random.Random(seed), 0.3, ITEMS)
    machine = ListDownload(PARTY, MissionType.MISSION)
    peer.talk(machine)
    assert machine.result.outcome is TransferOutcome.OK
    assert [i.lat_e7 for i in machine.result.items] == [i.lat_e7 for i in ITEMS]


@pytest.mark.parametrize("error", [1, 5])
def test_a_session_left_open_is_reset_once(error):
    """ArduRover refuses to open a file with error 1 while a dead program's session is open; the protocol has 5."""

    def answer(request, opcode, data=b""):
        packet = Packet(request.seq + 1, 0, opcode, 0, request.opcode, 0, 0, data)
        raw = wire.MAVLink_file_transfer_protocol_message(0, 1, 191, packet.pack())
        return Codec(1, 191).feed(Codec(1, 1).pack(raw))[0]

    machine = FtpWrite(PARTY, "@MISSION/mission.dat", b"data")
    opcodes, queue = [], machine.start(0.0)
    while queue:
        request = unpack(queue[0].payload)
        opcodes.append(request.opcode)
        refused = opcodes == [6]
        queue = machine.receive(0.1, answer(request, 129 if refused else 128, bytes([error]) if refused else b""))
    assert opcodes == [6, 2, 6, 7, 1]
    assert machine.result.outcome is TransferOutcome.OK

    machine = FtpWrite(PARTY, "@MISSION/mission.dat", b"data")
    queue = machine.start(0.0)
    for _ in range(3):
        request = unpack(queue[0].payload)
        queue = machine.receive(0.1, answer(request, 128 if request.opcode == 2 else 129, bytes([error])))
    assert machine.result.outcome is TransferOutcome.REFUSED, "once, not for ever"


@pytest.mark.parametrize(("offset", "data"), [(0, b""), (7, b"late")])
def test_a_read_that_is_answered_with_nothing_of_what_was_asked_ends(offset, data):
    """Such an answer was asked again at once, for ever."""
    machine, t_s = FtpRead(PARTY, "@SYS/x"), 0.0
    sent = machine.start(t_s)
    for n in range(1000):
        if not sent:
            t_s = machine.wake_s
            sent = machine.tick(t_s)
        if machine.result is not None:
            break
        asked = unpack(sent[0].payload)
        answer = Packet(asked.seq + 1, 1, 128, 0, asked.opcode, 0, offset if n else 0, data if n else bytes(4))
        reply = wire.MAVLink_file_transfer_protocol_message(0, 1, 191, answer.pack())
        sent = machine.receive(t_s, Codec(1, 191).feed(Codec(1, 1).pack(reply))[0])
    assert machine.result.outcome is TransferOutcome.TIMEOUT
    assert n < 50


def test_lost_parameters_are_asked_for_by_their_number():
    machine = ParamList(PARTY)

    def value(i):
        message = wire.MAVLink_param_value_message(f"P{i}".encode(), float(i), 9, 50, i)
        return Codec(1, 191).feed(Codec(1, 1).pack(message))[0]

    machine.start(0.0)
    for i in range(50):
        if i % 7:
            machine.receive(0.1, value(i))
    for _ in range(5):
        for request in machine.tick(machine.wake_s):
            machine.receive(machine.wake_s, value(request.param_index))
    assert machine.result.outcome is TransferOutcome.OK
    assert machine.result.values == {f"P{i}": float(i) for i in range(50)}


def test_renamed_parameters_know_both_names():
    assert names_of("SYSID_THISMAV") == ("SYSID_THISMAV", "MAV_SYSID")
    assert names_of("MAV_GCS_SYSID") == ("MAV_GCS_SYSID", "SYSID_MYGCS")
    assert names_of("SR0_EXTRA3") == ("SR0_EXTRA3", "MAV1_EXTRA3")
    assert names_of("WP_RADIUS") == ("WP_RADIUS",)
    assert len(set(ALIASES.values())) == len(ALIASES)
    assert all(len(name) <= 16 for name in ALIASES.values())


def test_a_stream_is_below_its_rate_when_it_is_slow_or_stale():
    table = (Stream("WIND", 2.0, 5.0, is_vital=True), Stream("ATTITUDE", 5.0, 2.0, is_vital=True))
    monitor = StreamMonitor(table)
    assert monitor.below_rate(0.0) == table
    for i in range(40):
        monitor.heard(i * 0.5, "WIND")
    for i in range(20):
        monitor.heard(float(i), "ATTITUDE")
    assert monitor.rate_hz(19.6, table[0]) == pytest.approx(2.0)
    assert [s.name for s in monitor.below_rate(19.6)] == ["ATTITUDE"]
    assert monitor.below_rate(25.0) == table


def test_a_signing_timestamp_that_cannot_be_stored_ends_nothing(tmp_path):
    """It raised in the link's heartbeat, on a full disk."""
    key = tmp_path / "key"
    key.write_text("ab" * 32)
    key.chmod(0o600)
    (tmp_path / "key.timestamp").mkdir()  # no file can take its place
    store = SigningStore(key, EPOCH_S + 1e8)
    store.state.timestamp += 10**9
    store.save()
    (tmp_path / "key.timestamp").rmdir()
    store.save()
    assert int((tmp_path / "key.timestamp").read_text()) > store.state.timestamp


@pytest.mark.parametrize("stored", ["9" * 20, "9" * 5000, str(2**48 - 1), "-5", "torn", b"\xff\xfe"])
def test_a_damaged_signing_timestamp_is_said_and_repaired_and_frames_are_signed(tmp_path, caplog, stored):
    """With 20 digits in the file every frame raised."""
    key = tmp_path / "key"
    key.write_text("ab" * 32)
    key.chmod(0o600)
    (tmp_path / "key.timestamp").write_bytes(stored if isinstance(stored, bytes) else stored.encode())
    store = SigningStore(key, EPOCH_S + 1e8)
    assert store.state.timestamp == int(1e8) * TICKS_PER_S
    assert "key.timestamp: holds b'" in caplog.text
    assert "written anew" in caplog.text
    assert int((tmp_path / "key.timestamp").read_text()) == store.state.timestamp + int(AHEAD_S * TICKS_PER_S)
    assert Codec(255, 190, store.state).pack(heartbeat(wire.MAV_STATE_ACTIVE))[2] == 1
    caplog.clear()
    SigningStore(key, EPOCH_S + 1e8)
    assert not caplog.text


def test_stamps_do_not_begin_anew_at_the_end_of_time():
    """The stamps of an autopilot whose clock is out of its mind move ours."""
    theirs, ours = (SigningState(key=bytes(32), timestamp=stamp) for stamp in (2**48 - 1, 0))
    codec = Codec(255, 190, ours)
    assert codec.feed(Codec(1, 1, theirs).pack(heartbeat(wire.MAV_STATE_ACTIVE)))
    for _ in range(3):
        assert codec.pack(heartbeat(wire.MAV_STATE_ACTIVE))[-12:-6] == b"\xff" * 6
    assert ours.timestamp == 2**48 - 1


def test_the_signing_clock_never_goes_back(tmp_path):
    key = tmp_path / "key"
    key.write_text("correct horse battery staple\n")
    key.chmod(0o600)
    now = EPOCH_S + 1_000_000.0
    first = SigningStore(key, now)
    assert first.state.timestamp == 1_000_000 * TICKS_PER_S
    used = first.state.timestamp + int(20.0 * TICKS_PER_S)
    first.state.timestamp = used
    first.save()
    # a board without a clock boots in 1970: it goes on after the last stamp that can have been used
    second = SigningStore(key, 0.0)
    assert second.state.timestamp >= used
    assert second.state.timestamp <= used + 2 * AHEAD_S * TICKS_PER_S
    assert len(second.state.key) == 32


def test_keys_that_are_open_empty_or_missing_are_refused(tmp_path):
    key = tmp_path / "key"
    with pytest.raises(InputError, match=f"no such file; check the path, or make one: companion key new {key}"):
        read_key(key)
    key.write_text("ab" * 32)
    key.chmod(0o644)
    with pytest.raises(InputError, match="chmod 600"):
        read_key(key)
    key.chmod(0o600)
    assert read_key(key) == bytes([0xAB]) * 32
    key.write_text("\n")
    with pytest.raises(InputError, match="empty"):
        read_key(key)
