"""The link with peers that a simulated autopilot does not play: signed ones, ground stations, real sockets."""

import asyncio
import os
import socket
import tty

import pytest
from pymavlink.dialects.v20 import ardupilotmega as wire

from companion.clock import now_s, run, run_virtual
from companion.errors import LinkError
from companion.mavlink.autopilot import Autopilot
from companion.mavlink.link import Link
from companion.mavlink.microservices.command import TransferOutcome
from companion.mavlink.reception import LinkIdentity
from companion.mavlink.signing import EPOCH_S, SigningStore
from companion.mavlink.transports import open_link
from companion.mavlink.wire import codec
from companion.mavlink.wire.frames import Codec, Drop, SigningState
from companion.mavlink.wire.items import mission_hash
from companion.messages import Command, GeoPoint, Mode, waypoint
from sitl.autopilot import AutopilotConfig, MemoryLink, SimulatedAutopilot, serve
from sitl.world.environment import Constant

BEAT = wire.MAVLink_heartbeat_message(11, 3, 0, 4, 3, 3)


class Peer:
    """A bare peer on the far end: hears messages, says what it is told."""

    def __init__(self, memory, *, system=1, component=1, signing=None):
        self.codec, self.end, self.heard = Codec(system, component, signing), memory.far, []

    async def __aenter__(self):
        await self.end.open(lambda data: self.heard.extend(self.codec.feed(data)))
        return self

    async def __aexit__(self, *_):
        await self.end.close()

    def say(self, message):
        self.end.write(self.codec.pack(message))

    def of(self, kind):
        return [m for m in self.heard if m.get_type() == kind]


def with_peer(main, *, peer_signing=None, **link_options):
    async def whole():
        memory = MemoryLink(seed=1)
        async with Peer(memory, signing=peer_signing) as peer, Link(memory.near, **link_options) as link:
            peer.say(BEAT)
            return await main(peer, link)

    return run_virtual(whole())


def test_the_end_of_32_bits_of_boot_time_is_no_reboot_of_the_link():
    async def main(peer, link):
        for ms in range(-20_000, 20_001, 500):
            peer.say(wire.MAVLink_attitude_message(ms % 2**32, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0))
            await asyncio.sleep(0.5)
        assert link.stats.reboots == 0
        assert link.boot_s == (2**32 + 20_000) / 1e3

    with_peer(main)


@pytest.mark.parametrize("held_s", [0.45, 0.6, 1.6, 3.0])
def test_what_waited_while_the_loop_was_held_up_proves_no_silence(held_s):
    """A computer that was busy for a moment read at once what had come, and took its own absence for a silence of the
    autopilot: the first forged mode in the queue was believed."""

    async def main(peer, link):
        heard, forger, boot = [], Codec(1, 1), now_s()
        link.subscribe(lambda _, message: heard.append((message.get_type(), getattr(message, "custom_mode", None))))

        def speak(seconds):
            """Say what the autopilot says in so long, at 50 Hz; every fifth frame has its boot time."""
            nonlocal boot
            for number in range(round(seconds * 50.0)):
                boot += 0.02
                peer.say(
                    wire.MAVLink_wind_message(90.0, 5.0, 0.0)
                    if number % 5
                    else wire.MAVLink_attitude_message(round(1e3 * boot), 0.0, 0.0, 1.0, 0.0, 0.0, 0.0)
                )

        for _ in range(100):
            speak(0.1)
            await asyncio.sleep(0.1)
        forged = wire.MAVLink_heartbeat_message(11, 3, 128, 5, 4, 3)
        for ahead in (15, 27):  # it knows no count, and comes before the autopilot's own in the queue
            forger._mav.seq = (peer.codec._mav.seq + ahead) % 256
            peer.end.write(forger.pack(forged))
        before = len(heard)
        speak(held_s)
        peer.say(BEAT)
        asyncio.get_running_loop().jump(held_s)  # nothing of ours runs
        await asyncio.sleep(0.3)
        late = heard[before:]
        assert ("HEARTBEAT", 5) not in late
        assert ("HEARTBEAT", BEAT.custom_mode) in late
        assert sum(kind == "WIND" for kind, _ in late) >= 0.9 * 40.0 * held_s
        assert link.stats.dropped[Drop.HELD] == 2
        return True

    assert with_peer(main)


def store(tmp_path):
    key = tmp_path / "key"
    key.write_text("0123456789abcdef" * 4)
    key.chmod(0o600)
    return SigningStore(key, EPOCH_S + 1e8)


def test_a_signed_link_talks_to_a_signed_autopilot(tmp_path):
    async def main(peer, link):
        await link.wait_autopilot(5.0)
        heard = []
        link.subscribe(lambda _, m: heard.append(m))
        for _ in range(30):
            peer.say(BEAT)
            await asyncio.sleep(1.0)
        assert len(heard) == 30
        assert peer.of("HEARTBEAT")
        assert not peer.codec.dropped
        return link

    ours = store(tmp_path)
    theirs = SigningState(key=ours.state.key, timestamp=ours.state.timestamp)
    before = ours.state.timestamp
    link = with_peer(main, peer_signing=theirs, signing=ours)
    assert link.dropped()[Drop.BAD_SIGNATURE] == 0
    assert ours.state.timestamp >= before + 29 * 100_000, "the stamp follows the clock"


def test_an_unsigned_autopilot_on_a_signed_link_is_told_apart(tmp_path):
    async def main(peer, link):
        with pytest.raises(LinkError, match=r"are not signed; .companion key set"):
            await link.wait_autopilot(3.0)

    with_peer(main, signing=store(tmp_path))


def test_a_ground_stations_command_to_us_is_answered_and_to_all_is_not():
    async def main(peer, link):
        await link.wait_autopilot(5.0)
        station = Codec(255, 190)
        wishes = []

        def wish(message):
            wishes.append(message.param1)
            return wire.MAV_RESULT_ACCEPTED

        def command(component, number):
            message = wire.MAVLink_command_long_message(1, component, number, 0, 3.0, 0, 0, 0, 0, 0, 0)
            peer.end.write(station.pack(message))

        command(191, wire.MAV_CMD_USER_1)
        command(0, wire.MAV_CMD_USER_1)
        command(1, wire.MAV_CMD_USER_1)
        await asyncio.sleep(0.1)
        acks = peer.of("COMMAND_ACK")
        assert [(a.result, a.target_system, a.target_component) for a in acks] == [(3, 255, 190)]
        link.on_command = wish
        command(191, wire.MAV_CMD_USER_1)
        await asyncio.sleep(0.1)
        assert wishes == [3.0]
        assert peer.of("COMMAND_ACK")[-1].result == wire.MAV_RESULT_ACCEPTED

    with_peer(main)


def test_rates_are_asked_one_by_one_and_again_after_silence():
    async def main(peer, link):
        async def live(seconds):
            for _ in range(seconds):
                peer.say(BEAT)
                for request in peer.of("COMMAND_LONG"):
                    peer.say(wire.MAVLink_command_ack_message(request.command, 0, 0, 0, 1, 191))
                await asyncio.sleep(1.0)

        await live(20)
        asked = [m.param1 for m in peer.of("COMMAND_LONG") if m.command == wire.MAV_CMD_SET_MESSAGE_INTERVAL]
        assert {33.0, 30.0, 168.0, 62.0, 42.0} <= set(asked)
        assert link.is_alive
        await asyncio.sleep(7.0)
        assert not link.is_alive
        assert link.is_lost
        peer.heard.clear()
        await live(15)
        again = {m.param1 for m in peer.of("COMMAND_LONG") if m.command == wire.MAV_CMD_SET_MESSAGE_INTERVAL}
        assert {33.0, 30.0, 168.0} <= again

    with_peer(main)


def test_a_command_on_a_dead_link_says_so():
    async def main(peer, link):
        await link.wait_autopilot(5.0)
        autopilot = Autopilot(link)
        await asyncio.sleep(3.0)
        began_s = now_s()
        answer = await autopilot.set_mode(Mode.HOLD)
        assert answer.outcome is TransferOutcome.LINK
        assert now_s() - began_s < 10.0

    with_peer(main, streams=())


def test_an_error_of_the_block_leaves_the_link_as_it_is():
    async def main(peer, link):
        await link.wait_autopilot(5.0)
        raise KeyError("mine")

    with pytest.raises(KeyError, match="mine"):
        with_peer(main)


def test_our_own_ids_from_elsewhere_are_not_listened_to():
    async def main(peer, link):
        await link.wait_autopilot(5.0)
        heard = []
        link.subscribe(lambda _, m: heard.append(m))
        peer.end.write(Codec(1, 191).pack(wire.MAVLink_statustext_message(3, b"echo", 0, 0)))
        await asyncio.sleep(0.1)
        assert not heard
        assert link.dropped()[Drop.FOREIGN_SYSTEM] == 1

    with_peer(main)


# ------------------------------------------------------------------------------------- real endpoints
def free_port(kind):
    with socket.socket(socket.AF_INET, kind) as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


async def sail_over(far_link, near_link):
    boat = SimulatedAutopilot(AutopilotConfig(is_warm=True), Constant(0.0, 5.0), seed=1)
    items = [waypoint(GeoPoint(lat_deg=51.1, lon_deg=-1.3 + 0.001 * i)) for i in range(1, 8)]
    items.append(waypoint(items[-1].point, command=Command.NAV_LOITER_UNLIM))
    async with (
        serve(boat, [far_link]),
        Link(open_link(near_link)) as link,
        Autopilot(link, timeout_s=60.0) as autopilot,
    ):
        assert (await autopilot.upload_mission(items)).is_ok
        assert (await autopilot.set_mode(Mode.AUTO)).is_ok
        assert (await autopilot.arm()).is_ok
        read = await autopilot.read_mission()
        assert mission_hash(read.items) == mission_hash(items)
        return link.dropped()


@pytest.mark.parametrize("kind", ["udp", "udp back", "tcp"])
def test_a_mission_over_real_sockets(kind):
    port = free_port(socket.SOCK_STREAM if kind == "tcp" else socket.SOCK_DGRAM)
    far, near = {
        "udp": (f"udpout:127.0.0.1:{port}", f"udpin:127.0.0.1:{port}"),
        "udp back": (f"udpin:127.0.0.1:{port}", f"udpout:127.0.0.1:{port}"),
        "tcp": (f"tcpin:127.0.0.1:{port}", f"tcp:127.0.0.1:{port}"),
    }[kind]
    dropped = run(sail_over(far, near), speedup=5.0)
    assert dropped[Drop.NOISE] == 0


def test_a_mission_over_a_serial_line():
    """The boat's end is the raw side of a pty, pumped to a memory link."""

    async def main():
        ours, theirs = os.openpty()
        tty.setraw(ours)
        os.set_blocking(ours, False)
        memory = MemoryLink(seed=1)
        loop = asyncio.get_running_loop()
        await memory.near.open(lambda data: os.write(ours, data))

        def readable():
            memory.near.write(os.read(ours, 4096))

        loop.add_reader(ours, readable)
        try:
            return await sail_over(memory.far, f"{os.ttyname(theirs)}:921600")
        finally:
            loop.remove_reader(ours)
            await memory.near.close()
            os.close(ours)
            os.close(theirs)

    assert run(main(), speedup=5.0)[Drop.BAD_CRC] == 0


# ------------------------------------------------------------------------------- whose boat, and who listens
def test_a_subscriber_that_raises_ends_no_transport_and_starves_nobody():
    said = []

    async def main(peer, link):
        await link.wait_autopilot(5.0)
        heard = []

        def bad(_, message):
            raise RuntimeError(f"cannot digest {message.get_type()}")

        link.subscribe(bad)
        link.subscribe(lambda _, m: heard.append(m))
        for _ in range(5):
            peer.say(BEAT)
            await asyncio.sleep(0.1)
        assert len(heard) == 5
        return link

    link = with_peer(main, on_fault=said.append)
    assert link.transport.stats.connections == 1
    assert [n for name, n in link.stats.faults.items() if "bad" in name] == [5]
    assert len(said) == 1
    assert "cannot digest HEARTBEAT" in said[0]


def test_a_log_that_cannot_be_written_ends_no_link():
    async def main(peer, link):
        await link.wait_autopilot(5.0)
        peer.say(BEAT)
        await asyncio.sleep(0.1)
        return link

    def full(_, frame):
        raise OSError(28, f"no space for {len(frame)} bytes")

    link = with_peer(main, sink=full)
    assert link.stats.faults["the tlog"] > 3
    assert link.has_autopilot


def test_a_listener_of_the_facade_that_raises_starves_nobody():
    async def main(peer, link):
        autopilot = Autopilot(link)
        await link.wait_autopilot(5.0)
        heard = []
        autopilot.on_value(lambda value: 1 / 0)
        autopilot.on_value(heard.append)
        peer.say(BEAT)
        await asyncio.sleep(0.1)
        assert heard

    with_peer(main)


def test_who_is_not_named_among_several_is_refused_and_listed():
    async def main(peer, link):
        other = Codec(7, 1)
        peer.end.write(other.pack(BEAT))
        with pytest.raises(LinkError, match=r"2 autopilots are heard: system 1 .*; system 7 .*: say which is yours"):
            await link.wait_autopilot(10.0)
        assert not peer.of("COMMAND_LONG"), "nothing was asked of either"

    with_peer(main)


def test_the_one_that_is_named_is_found_whoever_speaks_first():
    async def main(peer, link):
        with pytest.raises(LinkError, match=r"no autopilot's heartbeat of system 7; heard: system 1 \(surface boat"):
            await link.wait_autopilot(4.0)
        other = Codec(7, 1)
        peer.end.write(other.pack(BEAT))
        party = await link.wait_autopilot(4.0)
        assert (party.target_system, party.own_system) == (7, 7)
        heard = []
        link.subscribe(lambda _, m: heard.append(m.get_srcSystem()))
        peer.say(BEAT)
        peer.end.write(other.pack(BEAT))
        await asyncio.sleep(0.1)
        assert heard == [7]
        assert [s.system for s in link.neighbours()] == [1]

    with_peer(main, target_system=7)


def test_an_echo_is_told_from_a_second_companion():
    async def main(peer, link):
        await link.wait_autopilot(5.0)
        second = Codec(1, 191)
        for _ in range(5):
            for frame in [bytes(m.get_msgbuf()) for m in peer.of("HEARTBEAT")]:
                peer.end.write(frame)
            peer.heard.clear()
            await asyncio.sleep(1.0)
        assert link.other_companion() is None
        for token in (0, 77, 77):
            peer.end.write(second.pack(codec.heartbeat(token=token)))
            await asyncio.sleep(1.0)
        other = link.other_companion()
        assert (other.token, other.is_starting) == (77, False)

    with_peer(main, identity=LinkIdentity(token=12345))


def test_our_heartbeat_says_when_we_are_not_yet_at_work():
    async def main(peer, link):
        await link.wait_autopilot(5.0)
        link.started()
        await asyncio.sleep(2.0)
        states = [m.system_status for m in peer.of("HEARTBEAT")]
        assert states[0] == wire.MAV_STATE_BOOT
        assert states[-1] == wire.MAV_STATE_ACTIVE
        assert {m.custom_mode for m in peer.of("HEARTBEAT")} == {12345}

    with_peer(main, identity=LinkIdentity(token=12345), is_starting=True)
