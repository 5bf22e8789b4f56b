"""The mission protocol and what becomes of a mission, against failures.tlog, swap.tlog and ftp_upload.tlog."""

from __future__ import annotations

import asyncio
import math
import struct
from typing import Any

import pytest
from pymavlink.dialects.v20 import ardupilotmega as mav

from companion.clock import now_s
from sitl.autopilot.pilot.mission import to_file
from tests.sitl.boats import Client, e7, en, sail

SEVEN = [(60.0 * n, 0.0) for n in range(1, 7)]
EAST = [(100.0 * n, 0.0) for n in range(1, 7)]


def places(items: list[Any]) -> list[tuple[int, int]]:
    return [tuple(round(v) for v in en(i.x, i.y)) for i in items]


# ------------------------------------------------------------------------------------------------- transfers
def test_an_item_takes_one_loop_and_reads_back() -> None:
    async def job(c: Client) -> None:
        start = now_s()
        assert await c.upload([(float(n), 1.0) for n in range(1, 50)]) == 0
        requests = c.times("MISSION_REQUEST")
        assert len(requests) == 50
        assert requests[-1] - requests[0] == pytest.approx(49 * 0.02, abs=0.001)
        assert now_s() - start < 1.1
        assert c.texts()[-1] == "Flight plan received"
        back = await c.download()
        assert places(back[1:]) == [(n, 1) for n in range(1, 50)]
        assert (back[0].frame, back[0].command) == (0, 16)  # home, whatever was uploaded
        await asyncio.sleep(1.0)
        current = c.last("MISSION_CURRENT")
        assert (current.total, current.mission_state) == (49, 2)

    sail(job, is_moored=True)


def test_silence_is_asked_again_and_ends_after_eight_seconds() -> None:
    async def job(c: Client) -> None:
        assert await c.upload(SEVEN) == 0
        new = [(0.0, 0.0), *[(60.0 * n, -60.0) for n in range(1, 7)]]
        start = len(c.heard)
        c.answers["MISSION_REQUEST"] = lambda m: c.send(c.item(m.seq, new[m.seq])) if m.seq < 4 else None
        c.send(mav.MAVLink_mission_count_message(1, 1, 7, 0))
        ack = await c.wait("MISSION_ACK", 12.0)
        assert ack.type == 15
        assert c.texts()[-1] == "Mission upload timeout"
        asked = [t for t, m in c.heard[start:] if m.get_type() == "MISSION_REQUEST" and m.seq == 4]
        assert len(asked) == 8
        assert c.times("MISSION_ACK")[-1] - asked[0] == pytest.approx(8.0, abs=0.05)
        c.answers.clear()
        # a mixture is left behind: the first three new, the rest old
        assert places((await c.download())[1:]) == [(60 * n, -60) for n in (1, 2, 3)] + [(60 * n, 0) for n in (4, 5, 6)]

    sail(job)


def test_too_many_items() -> None:
    async def job(c: Client) -> None:
        assert await c.upload(SEVEN) == 0
        c.send(mav.MAVLink_mission_count_message(1, 1, 700, 0))
        assert (await c.wait("MISSION_ACK", 1.0)).type == 4
        assert c.texts()[-1] == "Only 655 items are supported"
        assert len(await c.download()) == 7
        c.send(mav.MAVLink_mission_count_message(1, 1, 85, 1))
        assert (await c.wait("MISSION_ACK", 1.0)).type == 4
        assert c.texts()[-1] == "Only 84 items are supported"

    sail(job)


def test_an_item_out_of_turn_is_refused_and_the_upload_goes_on() -> None:
    async def job(c: Client) -> None:
        items = [(0.0, 0.0), *SEVEN]

        def answer(m: Any) -> None:
            if m.seq == 2 and not c.of("MISSION_ACK"):
                c.send(c.item(5, items[5]))
            c.send(c.item(m.seq, items[m.seq]))

        c.answers["MISSION_REQUEST"] = answer
        c.send(mav.MAVLink_mission_count_message(1, 1, 7, 0))
        assert (await c.wait("MISSION_ACK", 1.0)).type == 13
        assert (await c.wait("MISSION_ACK", 2.0)).type == 0
        assert places((await c.download())[1:]) == [(60 * n, 0) for n in range(1, 7)]

    sail(job)


@pytest.mark.parametrize(
    ("bad", "ack"),
    [
        ({"en": (1.0, 1.0), "command": 9999}, 3),
        ({"en": (1.0, 1.0), "frame": 99}, 2),
        ({"e7": (1_200_000_000, 0)}, 10),
        ({"e7": (0, 1_900_000_000)}, 11),
        ({"en": (1.0, 1.0), "p1": math.nan}, 6),
    ],
)
def test_a_bad_item_ends_the_upload_with_the_mission_cut(bad: dict[str, Any], ack: int) -> None:
    async def job(c: Client) -> None:
        assert await c.upload(SEVEN) == 0
        assert await c.upload([bad, (5.0, 5.0)]) == ack
        await asyncio.sleep(1.0)
        assert c.last("MISSION_CURRENT").total == 2

    sail(job)


def test_another_uploader_is_denied() -> None:
    async def job(c: Client) -> None:
        items = [(0.0, 0.0), *SEVEN]
        other = mav.MAVLink(None, srcSystem=1, srcComponent=190)

        def answer(m: Any) -> None:
            if m.target_component == 191:
                if m.seq == 3:
                    c.write(mav.MAVLink_mission_count_message(1, 1, 4, 0).pack(other))
                    c.write(mav.MAVLink_mission_request_list_message(1, 1, 0).pack(other))
                c.send(c.item(m.seq, items[m.seq]))

        c.answers["MISSION_REQUEST"] = answer
        c.send(mav.MAVLink_mission_count_message(1, 1, 7, 0))
        await asyncio.sleep(1.0)
        assert [(m.target_component, m.type) for m in c.of("MISSION_ACK")] == [(190, 14), (190, 14), (191, 0)]

    sail(job)


def test_requests_and_partial_writes_out_of_range() -> None:
    async def job(c: Client) -> None:
        assert await c.upload(SEVEN) == 0
        c.send(mav.MAVLink_mission_request_int_message(1, 1, 50, 0))
        assert (await c.wait("MISSION_ACK", 1.0)).type == 1
        c.send(mav.MAVLink_mission_write_partial_list_message(1, 1, 9, 12, 0))
        assert (await c.wait("MISSION_ACK", 1.0)).type == 1
        assert c.texts()[-1] == "Flight plan update rejected"
        assert await c.ask(mav.MAV_CMD_DO_SET_MISSION_CURRENT, 9) == 2
        c.send(mav.MAVLink_mission_set_current_message(1, 1, 9))
        await asyncio.sleep(1.5)
        assert c.last("MISSION_CURRENT").seq == 0

    sail(job)


def test_old_request_gets_an_old_item() -> None:
    async def job(c: Client) -> None:
        assert await c.upload(SEVEN) == 0
        c.send(mav.MAVLink_mission_request_message(1, 1, 2, 0))
        item = await c.wait("MISSION_ITEM", 1.0)
        assert item.x == pytest.approx(e7(*SEVEN[1])[0] / 1e7, abs=1e-5)

    sail(job)


# -------------------------------------------------------------------------------------- while it is being sailed
def test_identical_upload_restarts_and_does_not_slow_down() -> None:
    async def job(c: Client) -> None:
        c.rate(mav.MAVLINK_MSG_ID_GLOBAL_POSITION_INT, 10)
        await c.set_sail(EAST)
        await asyncio.sleep(25.0)
        before = c.autopilot.truth
        start = now_s()
        assert await c.upload(EAST) == 0
        await asyncio.sleep(2.0)
        assert list(c.texts(start)).count("Auto mission changed, restarted command") == 7
        after = c.autopilot.truth
        assert abs(math.degrees(after.heading_rad - before.heading_rad)) < 2.0
        slow = min(math.hypot(m.vx, m.vy) / 100.0 for m in c.of("GLOBAL_POSITION_INT", start))
        assert slow > 2.88
        assert after.mission_seq == before.mission_seq

    sail(job, is_moored=True)


def test_moving_the_current_item_turns_the_boat_and_recentres_the_corridor() -> None:
    async def job(c: Client) -> None:
        c.rate(mav.MAVLINK_MSG_ID_NAV_CONTROLLER_OUTPUT, 10)
        await c.set_sail([(0.0, 300.0)])
        await asyncio.sleep(15.0)
        assert abs(c.last("NAV_CONTROLLER_OUTPUT").xtrack_error) > 12.0
        assert await c.upload([(0.0, 300.0)]) == 0
        await asyncio.sleep(0.3)
        assert abs(c.last("NAV_CONTROLLER_OUTPUT").xtrack_error) < 1.5
        assert await c.upload([(300.0, 0.0)]) == 0
        await asyncio.sleep(3.0)
        assert math.degrees(c.autopilot.truth.heading_rad) == pytest.approx(90.0, abs=12.0)
        assert c.autopilot.truth.mission_seq == 1

    sail(job, is_moored=True, heading_deg=45.0, SAIL_XTRACK_MAX=30.0)


def test_partial_write_changes_only_its_items() -> None:
    async def job(c: Client) -> None:
        await c.set_sail(EAST)
        new = {n: (100.0 * n, 50.0) for n in (4, 5, 6)}
        c.answers["MISSION_REQUEST"] = lambda m: c.send(c.item(m.seq, new[m.seq]))
        c.send(mav.MAVLink_mission_write_partial_list_message(1, 1, 4, 6, 0))
        assert (await c.wait("MISSION_ACK", 2.0)).type == 0
        assert len(c.of("MISSION_REQUEST")) == 7 + 3
        assert places((await c.download())[1:]) == [(100 * n, 50 if n > 3 else 0) for n in range(1, 7)]
        # from the last to one past the end appends
        new.update({6: (600.0, 60.0), 7: (700.0, 60.0)})
        c.send(mav.MAVLink_mission_write_partial_list_message(1, 1, 6, 7, 0))
        assert (await c.wait("MISSION_ACK", 2.0)).type == 0
        assert places(await c.download())[6:] == [(600, 60), (700, 60)]

    sail(job, is_moored=True)


def test_shorter_mission_without_and_with_set_current() -> None:
    async def job(c: Client) -> None:
        await c.set_sail(EAST[:4])
        await c.wait("MISSION_ITEM_REACHED", 90.0, lambda m: m.seq == 2)
        start = now_s()
        assert await c.upload([(0.0, 50.0)]) == 0  # shorter than index 3
        await asyncio.sleep(0.5)
        assert "Auto mission changed but failed to restart command" in c.texts(start)
        # sails on to the old target, reports it, and is done
        assert (await c.wait("MISSION_ITEM_REACHED", 60.0)).seq == 3
        await asyncio.sleep(1.5)
        assert c.texts()[-1] == "Mission Complete"
        current = c.last("MISSION_CURRENT")
        assert (current.seq, current.total, current.mission_state) == (3, 1, 5)
        # in this state a new mission does not start, nor does set-current without a reset
        assert await c.upload(EAST[:3]) == 0
        assert await c.ask(mav.MAV_CMD_DO_SET_MISSION_CURRENT, 1) == 0
        await asyncio.sleep(5.0)
        assert c.last("MISSION_CURRENT").mission_state == 2
        assert math.dist(EAST[2], (c.autopilot.truth.east_m, c.autopilot.truth.north_m)) < 20.0
        assert await c.ask(mav.MAV_CMD_DO_SET_MISSION_CURRENT, 1, 1) == 0
        await asyncio.sleep(20.0)
        assert c.last("MISSION_CURRENT").mission_state == 3
        assert math.dist(EAST[2], (c.autopilot.truth.east_m, c.autopilot.truth.north_m)) > 25.0

    sail(job, is_moored=True)


def test_new_mission_and_set_current_switch_at_once() -> None:
    async def job(c: Client) -> None:
        await c.set_sail(EAST)
        await c.wait("MISSION_ITEM_REACHED", 90.0, lambda m: m.seq == 2)
        assert await c.upload([(260.0, 200.0), (0.0, 200.0)]) == 0
        assert await c.ask(mav.MAV_CMD_DO_SET_MISSION_CURRENT, 1, 1) == 0
        current = c.last("MISSION_CURRENT")
        assert (current.seq, current.total, current.mission_state) == (1, 2, 3)

    sail(job, is_moored=True)


def test_clearing_a_running_mission_is_refused_and_count_0_empties_it() -> None:
    async def job(c: Client) -> None:
        await c.set_sail(EAST)
        c.send(mav.MAVLink_mission_clear_all_message(1, 1, 0))
        assert (await c.wait("MISSION_ACK", 1.0)).type == 1
        c.send(mav.MAVLink_mission_count_message(1, 1, 0, 0))
        assert (await c.wait("MISSION_ACK", 1.0)).type == 0
        await asyncio.sleep(1.5)
        assert c.last("MISSION_CURRENT").mission_state == 1
        assert (await c.wait("MISSION_ITEM_REACHED", 60.0)).seq == 1  # the target in memory

    sail(job, is_moored=True)


def test_hold_and_back_resumes_the_index() -> None:
    async def job(c: Client) -> None:
        await c.set_sail(EAST)
        await c.wait("MISSION_ITEM_REACHED", 60.0, lambda m: m.seq == 1)
        await c.ask(mav.MAV_CMD_DO_SET_MODE, 1, 4)
        await asyncio.sleep(3.0)
        assert c.last("MISSION_CURRENT").mission_state == 2
        assert await c.ask(mav.MAV_CMD_DO_SET_MODE, 1, 10) == 0
        await asyncio.sleep(1.5)
        assert (c.last("MISSION_CURRENT").seq, c.last("MISSION_CURRENT").mission_state) == (2, 3)

    sail(job, is_moored=True)


def test_do_jump_loops_and_hold_time_loiters() -> None:
    async def job(c: Client) -> None:
        jump = {"command": 177, "p1": 1.0, "p2": 1.0}
        await c.set_sail([(30.0, 0.0), {"en": (60.0, 0.0), "p1": 5.0}, jump, (60.0, 30.0)])
        await c.wait("STATUSTEXT", 300.0, lambda m: m.text == "Mission Complete")
        assert [m.seq for m in c.of("MISSION_ITEM_REACHED")] == [1, 2, 1, 2, 4]
        assert "Reached waypoint #2. Loiter for 5 seconds" in c.texts()

    sail(job, is_moored=True)


def test_modes_and_arming_are_refused_with_reasons() -> None:
    async def job(c: Client) -> None:
        assert await c.ask(mav.MAV_CMD_DO_SET_MODE, 1, 10) == 4
        assert c.texts()[-2:] == ["No Mission. Can't set AUTO.", "Flight mode change failed"]
        assert await c.ask(mav.MAV_CMD_DO_SET_MODE, 1, 77) == 4
        assert c.texts()[-1] == "No such mode 77"
        assert await c.ask(193, 0) == 3
        assert await c.ask(mav.MAV_CMD_REQUEST_MESSAGE, 231) == 4
        c.send(mav.MAVLink_param_set_message(1, 1, b"WNDVN_TYPE", 0.0, 9))
        assert await c.ask(mav.MAV_CMD_COMPONENT_ARM_DISARM, 1) == 4
        await asyncio.sleep(0.1)
        assert c.texts()[-1] == "Arm: Sailing enabled with no WindVane"

    sail(job)


def test_cold_boat_is_not_armed_before_its_position() -> None:
    async def job(c: Client) -> None:
        await asyncio.sleep(5.5)
        assert await c.upload(SEVEN) == 0
        assert await c.ask(mav.MAV_CMD_DO_SET_MODE, 1, 10) == 0
        assert await c.ask(mav.MAV_CMD_DO_SET_MODE, 1, 15) == 0
        assert await c.ask(mav.MAV_CMD_COMPONENT_ARM_DISARM, 1) == 4
        await asyncio.sleep(0.1)
        assert c.texts()[-2:] == ["Arm: Accels inconsistent", "Arm: AHRS: waiting for home"]
        await asyncio.sleep(37.0)
        assert await c.ask(mav.MAV_CMD_COMPONENT_ARM_DISARM, 1) == 0

    sail(job, is_warm=False)


# ------------------------------------------------------------------------------------------------------- MAVFTP
class Ftp:
    def __init__(self, client: Client) -> None:
        self.c, self.seq = client, 0

    async def ask(self, opcode: int, data: bytes = b"", offset: int = 0, size: int | None = None) -> tuple[int, bytes]:
        self.seq += 1
        head = struct.pack("<HBBBBBBI", self.seq, 0, opcode, len(data) if size is None else size, 0, 0, 0, offset)
        self.c.send(mav.MAVLink_file_transfer_protocol_message(0, 1, 1, list((head + data).ljust(251, b"\0"))))
        want = self.seq + 1
        m = await self.c.wait(
            "FILE_TRANSFER_PROTOCOL", 1.0, lambda m: struct.unpack_from("<H", bytes(m.payload))[0] == want
        )
        raw = bytes(m.payload)
        return raw[3], raw[12 : 12 + raw[4]]

    async def write(self, path: str, data: bytes) -> int:
        assert (await self.ask(6, path.encode()))[0] == 128
        for start in range(0, len(data), 239):
            assert (await self.ask(7, data[start : start + 239], start))[0] == 128
        return (await self.ask(1))[0]

    async def read(self, path: str) -> bytes:
        assert (await self.ask(4, path.encode()))[0] == 128
        out = b""
        while True:
            code, data = await self.ask(5, b"", len(out), 239)
            if code == 129:
                assert data == b"\x06"
                break
            out += data
        await self.ask(1)
        return out


def mission_file(specs: list[Any], *, options: int = 0, start: int = 0) -> bytes:
    from sitl.autopilot.pilot.mission import Item

    items = [Item(16, 3, 0, 0, 0, 0, *e7(*place), 0.0) for place in specs]
    head = struct.pack("<HHHHH", 0x763D, 0, options, start, len(items))
    return head + b"".join(to_file(item, start + n, 0) for n, item in enumerate(items))


def test_ftp_upload_is_one_restart_and_leaves_an_old_tail() -> None:
    async def job(c: Client) -> None:
        ftp = Ftp(c)
        await c.set_sail(EAST)
        await asyncio.sleep(5.0)
        start = now_s()
        thirty = [(0.0, 0.0), *[(40.0 * n, 0.0) for n in range(1, 30)]]
        assert await ftp.write("@MISSION/mission.dat", mission_file(thirty)) == 128
        assert now_s() - start == pytest.approx(0.15, abs=0.03)
        await asyncio.sleep(0.5)
        assert c.texts(start).count("Auto mission changed, restarted command") == 1
        assert len(await c.download()) == 30
        raw = await ftp.read("@MISSION/mission.dat")
        assert len(raw) == 1150
        assert raw[:10] == struct.pack("<HHHHH", 0x763D, 0, 0, 0, 30)
        assert raw[10 + 38 :] == mission_file(thirty)[10 + 38 :]
        # while it runs it is not cleared: a shorter file leaves the tail
        twelve = [(0.0, 0.0), *[(45.0 * n, 0.0) for n in range(1, 12)]]
        assert await ftp.write("@MISSION/mission.dat", mission_file(twelve)) == 128
        assert places(await c.download())[10:14] == [(450, 0), (495, 0), (480, 0), (520, 0)]
        two = [(1.0, 7.0), (2.0, 7.0)]
        assert await ftp.write("@MISSION/mission.dat", mission_file(two, options=1, start=6)) == 128
        after = places(await c.download())
        assert len(after) == 30
        assert after[5:9] == [(225, 0), (1, 7), (2, 7), (360, 0)]

    sail(job, is_moored=True)


def test_ftp_refusals() -> None:
    async def job(c: Client) -> None:
        ftp = Ftp(c)
        assert await ftp.ask(4, b"none.dat") == (129, b"\x0a")
        assert (await ftp.ask(7, b"x", 0))[0] == 129
        # TerminateSession is acknowledged whatever becomes of the file
        for data in (b"", b"abc", b"\0\0" + mission_file(SEVEN)[2:]):
            assert await ftp.write("@MISSION/mission.dat", data) == 128
        assert c.autopilot.pilot.helm.mission.items == []
        bad = bytearray(mission_file([(0.0, 0.0), *SEVEN[:3]]))
        struct.pack_into("<H", bad, 10 + 38 * 2 + 30, 9999)
        assert await ftp.write("@MISSION/mission.dat", bytes(bad)) == 128
        assert len(await c.download()) == 2  # up to the bad item
        assert await ftp.write("@MISSION/mission.dat", mission_file([(0.0, 0.0), *SEVEN[:2]])[:-5]) == 128
        assert len(await c.download()) == 3
        assert (await ftp.ask(200))[0] == 129
        assert await ftp.ask(3, b"@MISSION") == (129, b"\x02\x16")
        assert (await ftp.ask(4, b"@MISSION/mission.dat"))[0] == 128
        assert await ftp.ask(4, b"@MISSION/mission.dat") == (129, b"\x01")
        await ftp.ask(1)
        # an answer lost on the way: the same question is answered again, the work is not done twice
        assert (await ftp.ask(6, b"@MISSION/mission.dat"))[0] == 128
        ftp.seq -= 1
        assert (await ftp.ask(6, b"@MISSION/mission.dat"))[0] == 128

    sail(job)


def test_a_reset_outside_auto_before_the_first_auto_is_an_internal_error() -> None:
    async def job(c: Client) -> None:
        assert await c.upload(EAST) == 0
        assert await c.ask(mav.MAV_CMD_DO_SET_MISSION_CURRENT, 2, 0) == 0
        await asyncio.sleep(1.5)
        assert c.last("MISSION_CURRENT").mission_state == 2
        assert c.last("SYS_STATUS").errors_count2 == 0
        start = now_s()
        assert await c.ask(mav.MAV_CMD_DO_SET_MISSION_CURRENT, 1, 1) == 0
        await asyncio.sleep(1.5)
        assert c.texts(start)[:2] == ["Mission: 1 WP", "Internal Errors 0x20000000"]
        current = c.last("MISSION_CURRENT")
        assert (current.seq, current.mission_state, current.mission_mode) == (1, 3, 0)
        assert c.last("SYS_STATUS").errors_count2 == 0x2000
        for mode in (0, 10):
            assert await c.ask(mav.MAV_CMD_DO_SET_MODE, 1, mode) == 0
            start = now_s()
            assert await c.ask(mav.MAV_CMD_COMPONENT_ARM_DISARM, 1) == 4
            await asyncio.sleep(0.2)
            assert c.texts(start)[-2:] == ["Arm: Internal errors 0x20000000 l:90 invalid argum", "ents"]
        assert await c.ask(mav.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN, 1) == 0
        await asyncio.sleep(60.0)
        assert await c.ask(mav.MAV_CMD_DO_SET_MODE, 1, 10) == 0
        assert await c.ask(mav.MAV_CMD_COMPONENT_ARM_DISARM, 1) == 0

    sail(job, is_moored=True)


def test_a_reset_outside_auto_after_the_first_auto_runs_the_mission_and_sails_nothing() -> None:
    async def job(c: Client) -> None:
        assert await c.upload(EAST) == 0
        for mode in (10, 4):
            assert await c.ask(mav.MAV_CMD_DO_SET_MODE, 1, mode) == 0
            await asyncio.sleep(1.0)
        start = now_s()
        assert await c.ask(mav.MAV_CMD_DO_SET_MISSION_CURRENT, 1, 1) == 0
        await asyncio.sleep(1.5)
        assert c.texts(start) == ["Mission: 1 WP"]
        current = c.last("MISSION_CURRENT")
        assert (current.seq, current.mission_state, current.mission_mode) == (1, 3, 0)
        assert await c.ask(mav.MAV_CMD_COMPONENT_ARM_DISARM, 1) == 0
        await asyncio.sleep(30.0)
        assert abs(c.autopilot.truth.east_m) < 1.0  # it drifts with the wind, to the south
        assert await c.ask(mav.MAV_CMD_DO_SET_MODE, 1, 10) == 0
        await c.wait("MISSION_ITEM_REACHED", 90.0, lambda m: m.seq == 2)

    sail(job, is_moored=True)
