"""``companion order`` on a link: its answers, its patience, its exit codes."""

import json
import socket
import threading
import time

import pytest
from pymavlink.dialects.v20 import ardupilotmega as wire

from companion import cli
from companion.mavlink import vehicle_identity
from companion.mavlink.wire.codec import status_texts
from companion.mavlink.wire.frames import Codec
from sitl.scenario.traffic import free_port

BEAT = wire.MAVLink_heartbeat_message(
    wire.MAV_TYPE_SURFACE_BOAT,
    wire.MAV_AUTOPILOT_ARDUPILOTMEGA,
    wire.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED,
    0,
    wire.MAV_STATE_STANDBY,
    3,
)


class Boat:
    """An autopilot that beats, and a companion that answers orders: ``lost`` of its answers never arrive."""

    def __init__(self, port, result=0, text="loitering here, where there is room, until go_on", lost=0):
        self.result, self.text, self.lost = result, text, lost
        self.commands, self._stop = [], threading.Event()
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.bind(("127.0.0.1", 0))
        self._socket.settimeout(0.05)
        self._to = ("127.0.0.1", port)
        self._thread = threading.Thread(target=self._run)
        self._thread.start()

    def close(self):
        self._stop.set()
        self._thread.join()
        self._socket.close()

    def _run(self):
        autopilot, companion, ears = Codec(1, 1), Codec(1, 191), Codec(1, 191)
        beat_s = 0.0
        while not self._stop.is_set():
            if time.monotonic() - beat_s > 0.2:
                beat_s = time.monotonic()
                self._socket.sendto(autopilot.pack(BEAT), self._to)
            try:
                data = self._socket.recv(4096)
            except TimeoutError:
                continue
            for message in ears.feed(data):
                if message.get_type().startswith("COMMAND_") and message.target_component == 191:
                    self._answer(message, companion)

    def _answer(self, message, companion):
        self.commands.append(message)
        if len(self.commands) <= self.lost:
            return
        verb = "goal" if message.command == 31011 else {1: "hold", 4: "refuge", 11: "why"}[int(message.param1)]
        ack = wire.MAVLink_command_ack_message(
            message.command, self.result, 0, 0, message.get_srcSystem(), message.get_srcComponent()
        )
        for reply in (ack, *status_texts(5, f"order {verb}: {self.text}", 7)):
            self._socket.sendto(companion.pack(reply), self._to)


@pytest.fixture
def boat(monkeypatch):
    monkeypatch.setattr(vehicle_identity, "LISTEN_S", 0.3)
    boats = []

    def launch(**how):
        boats.append(Boat(free_port(), **how))
        return boats[-1]

    yield launch
    for launched in boats:
        launched.close()


def order(boat, *words, timeout="4"):
    return cli.main(["order", *words, "--link", f"udpin:127.0.0.1:{boat._to[1]}", "--timeout", timeout])


def test_the_answer_is_printed(boat, capsys):
    her = boat()
    assert order(her, "hold") == 0
    assert capsys.readouterr().out == "hold: loitering here, where there is room, until go_on\n"
    assert {(m.get_srcSystem(), m.get_srcComponent()) for m in her.commands} == {(254, 190)}, "never 255"


def test_a_refusal_says_why(boat, capsys):
    long = "the mission has no such refuge: it has 1 Cove, 2 Creek, 3 a harbour with a name that is longer than a chunk"
    her = boat(result=2, text=long)
    assert order(her, "refuge", "Mill", "Bay") == 1
    assert capsys.readouterr().out == f"refuge Mill Bay: refused: {long}\n"


def test_a_lost_answer_is_asked_for_again(boat, capsys):
    her = boat(lost=1)
    assert order(her, "goal", "50.8195", "-1.3080") == 0
    assert "goal 50.81950 -1.30800: loitering" in capsys.readouterr().out
    assert [(m.x, m.y) for m in her.commands] == [(508195000, -13080000)] * 2


def test_nobody_answers(boat, capsys):
    assert order(boat(lost=99), "why", timeout="1") == 3
    assert "no answer within 1 s from the companion" in capsys.readouterr().err
    assert cli.main(["order", "hold", "--link", f"udpin:127.0.0.1:{free_port()}", "--timeout", "0.2"]) == 3
    assert "nothing was heard at all" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (["hodl", "--link", "x"], "did you mean hold?"),
        (["hold"], "--link: is missing"),
        ([], "VERB: is missing"),
        (["goal", "0", "0", "--link", "x"], "no position"),
        (["hold", "--qgc", "o.json"], "leave out the verb"),
    ],
)
def test_bad_usage(words, says, capsys):
    assert cli.main(["order", *words]) == 2
    assert says in capsys.readouterr().err


def test_the_buttons_are_written_and_not_over_a_file_of_that_name(tmp_path, capsys):
    file = tmp_path / "Orders.json"
    assert cli.main(["order", "--qgc", str(file)]) == 0
    assert json.loads(file.read_text())["fileType"] == "MavlinkActions"
    assert cli.main(["order", "--qgc", str(file)]) == 2
    assert cli.main(["order", "--qgc", str(file), "--force"]) == 0
    capsys.readouterr()


def test_a_folder_in_place_of_the_socket_is_called_that(tmp_path, capsys):
    assert cli.main(["order", "hold", "--socket", str(tmp_path)]) == 2
    assert f"{tmp_path}: is a folder" in capsys.readouterr().err


def test_a_slip_in_a_command_of_a_command_is_answered_with_what_was_meant(capsys):
    assert cli.main(["mission", "chekc", "lake.toml"]) == 2
    assert "there is no command 'chekc'; did you mean `companion mission check`?" in capsys.readouterr().err


@pytest.mark.parametrize("force", [[], ["--force"]])
def test_a_folder_is_no_file_for_the_buttons(tmp_path, capsys, force):
    """It was offered --force, which writes over no folder."""
    assert cli.main(["order", "--qgc", str(tmp_path), *force]) == 2
    assert capsys.readouterr().err == f"companion order: {tmp_path}: is a folder; name a file in it\n"


def test_a_folder_is_no_mission_to_rehearse(tmp_path, capsys):
    assert cli.main(["rehearse", str(tmp_path)]) == 2
    said = "is a folder; name the TOML file of a mission or a scenario"
    assert capsys.readouterr().err == f"companion rehearse: {tmp_path}: {said}\n"
