"""``companion wind`` on records made here: CSV, tlog and ArduPilot .bin."""

import json
import math
import struct

import pytest
from pymavlink.dialects.v20 import ardupilotmega as dialect

from companion.cli import main
from companion.commands.wind import read_record
from companion.errors import InputError
from companion.mavlink.tlog import stamp
from lab.simulated_wind import weather


def write_csv(path, record, *, extra=True):
    head = "t_s,wind_from_deg,wind_speed_ms" + (",turning,heading_deg,awa_deg" if extra else "")
    rows = [head]
    for t, d, s in zip(record.t_s, record.twd_from_rad, record.tws_mps, strict=True):
        deg = math.degrees(d)
        side = -45.0 if t % 400 < 200 else 45.0
        tail = f",{int(t % 200 < 10)},{(deg - side) % 360:.0f},{side % 360:.0f}" if extra else ""
        rows.append(f"{t:.0f},{deg % 360:.1f},{s:.2f}" + tail)
    path.write_text("\n".join(rows) + "\n")
    return path


@pytest.fixture
def csv_record(tmp_path):
    return write_csv(tmp_path / "afternoon.csv", weather(31, seconds=2400.0, mean_rad=6.2))


def test_scores_fit_picture_and_figures(csv_record, tmp_path, capsys):
    picture, figures = tmp_path / "p.png", tmp_path / "f.json"
    assert main(["wind", str(csv_record), "--estimator", "mean90", "--plot", str(picture), "--json", str(figures)]) == 0
    out = capsys.readouterr().out
    assert "rho 0." in out
    assert "± " in out
    assert "mean90" in out
    assert picture.read_bytes()[:4] == b"\x89PNG"
    document = json.loads(figures.read_text())
    (record,) = document["records"]
    assert record["readings"] == 2400
    assert {s["horizon_s"] for s in record["scores"]} == {10, 30, 60, 120, 300, 600}
    assert record["ar1"]["rho_error_hz"] > 0


def test_all_estimators_and_a_folder(tmp_path, capsys):
    for seed in (1, 2):
        write_csv(tmp_path / f"r{seed}.csv", weather(seed, seconds=1500.0), extra=False)
    assert main(["wind", str(tmp_path), "--estimator", "all"]) == 0
    out = capsys.readouterr().out
    assert "mean of 2 records" in out
    for name in ("default", "kalman", "ou", "arma", "garch", "mean90", "mean5"):
        assert f"\n{name} " in out


def test_cost_is_a_ratio_to_the_kalman_filter(csv_record, capsys):
    assert main(["wind", str(csv_record), "--cost"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[1].split()[0] == "kalman"
    assert lines[1].split()[2] == "1.00"
    assert lines[2].split()[0] == "default"


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["nowhere.csv"], "no such file"),
        (["RECORD", "--estimator", "oracle"], "choose default"),
        (["RECORD", "--plot", "/no/such/folder/p.png"], "/no/such/folder/p.png: /no/such/folder does not exist"),
        (["RECORD", "--plot", "p.nonsense"], "end it in one of .png"),
    ],
)
def test_bad_usage_exits_2_with_one_line(arguments, words, csv_record, capsys, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    assert main(["wind", *[str(csv_record) if a == "RECORD" else a for a in arguments]]) == 2
    error = capsys.readouterr().err
    assert words in error
    assert error.count("\n") == 1


def test_an_empty_folder_and_a_text_that_is_no_text(tmp_path, capsys):
    (tmp_path / "empty").mkdir()
    assert main(["wind", str(tmp_path / "empty")]) == 2
    bad = tmp_path / "b.csv"
    bad.write_bytes(b"\xff\xfe\x00\x80")
    assert main(["wind", str(bad)]) == 2
    assert "is not text" in capsys.readouterr().err


def test_a_short_record_is_told_apart_from_a_bad_one(tmp_path, capsys):
    path = write_csv(tmp_path / "short.csv", weather(1, seconds=300.0))
    assert main(["wind", str(path), "--plot", str(tmp_path / "p.png")]) == 0
    assert "too short to score" in capsys.readouterr().out


def test_a_tlog_is_read(tmp_path):
    mav = dialect.MAVLink(None, srcSystem=1, srcComponent=1)
    path = tmp_path / "v.tlog"
    with path.open("wb") as log:
        for k in range(400):
            unix_us = 1_790_000_000_000_000 + k * 500_000
            yaw = 0.0 if k < 200 else 1.5
            log.write(stamp(unix_us, mav.attitude_encode(k * 500, 0.0, 0.0, yaw, 0.0, 0.0, 0.0).pack(mav)))
            log.write(stamp(unix_us, mav.named_value_float_encode(k * 500, b"AppWndDir", -40.0).pack(mav)))
            log.write(stamp(unix_us, mav.wind_encode(350.0 + k % 5, 5.0, 0.0).pack(mav)))
    record = read_record(path)
    assert len(record) == 400
    assert record.duration_s == pytest.approx(199.5)
    assert math.degrees(record.twd_from_rad[3]) == pytest.approx(353.0)
    assert record.tws_mps[0] == pytest.approx(5.0)
    assert math.degrees(record.awa_rad[10]) == pytest.approx(-40.0)
    assert bool(record.turning[200])
    assert not record.turning[:170].any()
    assert not record.turning[245:].any()


def dataflash(path, rows):
    """Write a minimal ArduPilot log: FMT of FMT and WIND, then WIND rows (time_us, true direction, true speed)."""
    head, kind = b"\xa3\x95", 200

    def fmt(number, length, name, form, columns):
        packed = struct.pack("<BB4s16s64s", number, length, name, form, columns)
        return head + bytes([128]) + packed

    columns = b"TimeUS,DrRaw,DrApp,DrTru,SpdRaw,SpdApp,SpdTru"
    data = fmt(128, 89, b"FMT", b"BBnNZ", b"Type,Length,Name,Format,Columns")
    data += fmt(kind, 3 + 8 + 24, b"WIND", b"Qffffff", columns)
    for time_us, direction, speed in rows:
        data += head + bytes([kind]) + struct.pack("<Qffffff", time_us, 0.0, -30.0, direction, 0.0, 6.0, speed)
    path.write_bytes(data)
    return path


@pytest.mark.filterwarnings("ignore")
def test_an_ardupilot_log_is_read(tmp_path):
    path = dataflash(tmp_path / "00000001.BIN", [(1_000_000 * k, 10.0 + k % 3, 4.0) for k in range(1, 301)])
    record = read_record(path)
    assert len(record) == 300
    assert record.duration_s == pytest.approx(299.0, abs=0.01)
    assert math.degrees(record.twd_from_rad[2]) == pytest.approx(10.0, abs=1e-3)
    assert record.tws_mps[7] == pytest.approx(4.0)


def test_an_empty_record_is_called_empty(tmp_path):
    """It had "no column t_s" in line 1."""
    path = tmp_path / "none.csv"
    path.touch()
    with pytest.raises(InputError, match=r"none\.csv: is empty; name a CSV, tlog or \.bin"):
        read_record(path)


def test_a_log_without_wind_is_refused(tmp_path):
    path = tmp_path / "none.tlog"
    path.write_bytes(b"")
    with pytest.raises(InputError, match="is empty"):
        read_record(path)
    path.write_bytes(stamp(1_790_000_000_000_000, b""))
    with pytest.raises(InputError, match="no MAVLink frame"):
        read_record(path)
    mav = dialect.MAVLink(None, srcSystem=1, srcComponent=1)
    path.write_bytes(stamp(1_790_000_000_000_000, mav.attitude_encode(0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0).pack(mav)))
    with pytest.raises(InputError, match="0 WIND messages"):
        read_record(path)
