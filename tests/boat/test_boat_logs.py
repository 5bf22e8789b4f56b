"""Logs of every kind are read to the same sailing; what is of no use is said, skipped and counted."""

import csv
import gzip
import io
import math
import re
import struct
from pathlib import Path

import numpy as np
import pytest
from pymavlink.dialects.v20 import ardupilotmega as wire

from companion.boat_logs import logs_under, read_logs
from companion.errors import InputError
from companion.mavlink.tlog import stamp
from lab.simulated_logs import Truth, sailed

LOG = sailed(Truth(scale=0.7), hours=0.1, seed=1)
EPOCH_S = 1_750_000_000
LAT, LON = 50.8, -1.3
DEGREE_M = 111_195.0
KNOT = 1852.0 / 3600.0


def place(i):
    east, north = LOG.position_en_m[i]
    return LAT + north / DEGREE_M, LON + east / DEGREE_M / math.cos(math.radians(LAT))


def tlog(path, *, system=1, second_system=None, without=(), jump_s=0, reboot_at=None, held_from=10_000):
    out = b""
    for i, t_s in enumerate((LOG.t_s - LOG.t_s[0]).tolist()):
        boot_ms = int(1000.0 * (60.0 + t_s))
        if reboot_at is not None and i >= reboot_at:
            boot_ms = int(1000.0 * (t_s - reboot_at))
        unix_us = int(1e6 * (EPOCH_S + t_s + (jump_s if i > 100 else 0)))
        for one in (system, *(() if second_system is None else (second_system,))):
            mav = wire.MAVLink(None, srcSystem=one, srcComponent=1)
            lat, lon = place(i)
            ve, vn = LOG.velocity_en_mps[i]
            messages = {
                "HEARTBEAT": mav.heartbeat_encode(11, 3, 0x80, 4 if i >= held_from else 10, 4),
                "VFR_HUD": mav.vfr_hud_encode(0, 0, 0, 0, 0, 0),
                "ATTITUDE": mav.attitude_encode(boot_ms, 0, 0, LOG.heading_rad[i], 0, 0, 0),
                "AppWndSpd": mav.named_value_float_encode(boot_ms, b"AppWndSpd", LOG.aws_mps[i]),
                "AppWndDir": mav.named_value_float_encode(boot_ms, b"AppWndDir", math.degrees(LOG.awa_rad[i])),
                "GLOBAL_POSITION_INT": mav.global_position_int_encode(
                    boot_ms, int(lat * 1e7), int(lon * 1e7), 0, 0, round(100 * vn), round(100 * ve), 0, 65535
                ),
            }
            for name, message in messages.items():
                if name not in without:
                    out += stamp(unix_us, message.pack(mav))
    path.write_bytes(out)
    return path


def table(path, *, without=(), knots=False):
    text = io.StringIO()
    names = ["t_s", "heading_deg", "cog_deg", "sog_kn" if knots else "sog_mps", "awa_deg", "aws_mps"]
    rows = csv.writer(text)
    rows.writerow([n for n in names if n not in without])
    for i, t_s in enumerate(LOG.t_s):
        ve, vn = LOG.velocity_en_mps[i]
        values = [
            t_s,
            math.degrees(LOG.heading_rad[i]) % 360.0,
            math.degrees(math.atan2(ve, vn)) % 360.0,
            math.hypot(ve, vn) / (KNOT if knots else 1.0),
            math.degrees(LOG.awa_rad[i]),
            LOG.aws_mps[i],
        ]
        rows.writerow([v for n, v in zip(names, values, strict=True) if n not in without])
    path.write_text(text.getvalue())
    return path


def test_a_log_that_is_too_short_is_called_so(tmp_path):
    """It was said to tell the boat's speed in 21 of 21 samples, and skipped."""
    path = table(tmp_path / "short.csv")
    path.write_text("\n".join(path.read_text().splitlines()[:22]) + "\n")
    _, [skipped] = read_logs([path])
    assert skipped.why == "it is too short: 21 samples, one a second, of 60 at least"


def nmea(path, *, spoiled=()):
    lines = []

    def say(body):
        total = 0
        for character in body:
            total ^= ord(character)
        lines.append(f"${body}*{total:02X}")

    for i in range(LOG.t_s.shape[0]):
        lat, lon = place(i)
        ve, vn = LOG.velocity_en_mps[i]
        clock = f"{10 + i // 3600:02d}{i // 60 % 60:02d}{i % 60:02d}"
        where = f"{int(lat):02d}{60 * (lat % 1):07.4f},N,{int(-lon):03d}{60 * (-lon % 1):07.4f},W"
        course = math.degrees(math.atan2(ve, vn)) % 360
        say(f"GPRMC,{clock}.00,A,{where},{math.hypot(ve, vn) / KNOT:.3f},{course:.2f},090625,2.0,W")
        say(f"HCHDG,{(math.degrees(LOG.heading_rad[i]) + 2.0) % 360:.2f},,,2.0,W")
        say(f"WIMWV,{math.degrees(LOG.awa_rad[i]) % 360:.2f},R,{LOG.aws_mps[i] / KNOT:.3f},N,A")
        say(f"IIVHW,,T,,M,{LOG.stw_mps[i] if math.isfinite(LOG.stw_mps[i]) else 2.0:.2f},N,,K")
    for i in spoiled:
        lines[i] = lines[i].replace("9", "8")
    path.write_text("\n".join(lines))
    return path


FORMATS = {  # name: id, format, labels
    "ATT": (131, "Qf", "TimeUS,Yaw"),
    "XKF1": (132, "QBff", "TimeUS,C,VN,VE"),
    "POS": (133, "QLL", "TimeUS,Lat,Lng"),
    "WIND": (134, "Qffff", "TimeUS,DrApp,SpdApp,DrTru,SpdTru"),
    "MODE": (135, "QMB", "TimeUS,Mode,ModeNum"),
    "GPS": (136, "QBIHff", "TimeUS,Status,GMS,GWk,Spd,GCrs"),
}
CODES = {"Q": "Q", "f": "f", "B": "B", "L": "i", "M": "B", "I": "I", "H": "H"}


def bin_log(path, *, cut=0):
    def packed(number, codes, *values):
        return bytes([0xA3, 0x95, number]) + struct.pack("<" + "".join(CODES[c] for c in codes), *values)

    out = b""
    fmt = struct.Struct("<BB4s16s64s")
    lengths = {"FMT": (128, 89, "BBnNZ", "Type,Length,Name,Format,Columns")}
    lengths |= {
        n: (i, 3 + struct.calcsize("<" + "".join(CODES[c] for c in f)), f, c) for n, (i, f, c) in FORMATS.items()
    }
    for name, (number, length, codes, labels) in lengths.items():
        out += bytes([0xA3, 0x95, 128]) + fmt.pack(number, length, name.encode(), codes.encode(), labels.encode())
    week_s = 315_964_800 + 2300 * 604_800 - 18
    for i, t_s in enumerate((LOG.t_s - LOG.t_s[0]).tolist()):
        us = int(1e6 * (60.0 + t_s))
        lat, lon = place(i)
        ve, vn = LOG.velocity_en_mps[i]

        def say(name, *values, us=us):
            nonlocal out
            out += packed(FORMATS[name][0], FORMATS[name][1], us, *values)

        if i == 0:
            say("MODE", 10, 10)
        say("GPS", 3, int(1000 * t_s), 2300, math.hypot(ve, vn), math.degrees(math.atan2(ve, vn)))
        say("POS", int(lat * 1e7), int(lon * 1e7))
        say("XKF1", 0, vn, ve)
        say("XKF1", 1, 9.0, 9.0)
        say("WIND", math.degrees(LOG.awa_rad[i]), LOG.aws_mps[i], 0.0, 5.0)
        say("ATT", math.degrees(LOG.heading_rad[i]) % 360.0)
    path.write_bytes(out[: len(out) - cut])
    return path, week_s


def only(path):
    read, skipped = read_logs([path])
    assert not skipped
    return read[0].log


def same(log, *, wind_mps=0.2, first=3):
    """Assert that a log is the one that was written: wind over the ground, speed, seconds."""
    n = min(log.t_s.shape[0], LOG.t_s.shape[0]) - first
    assert n > 340
    shift = LOG.t_s.shape[0] - log.t_s.shape[0]
    assert abs(shift) <= 2
    for name in ("velocity_en_mps", "wind_en_mps"):
        told, true = getattr(log, name)[first : first + n], getattr(LOG, name)
        best = min(
            np.nanmedian(np.abs(told - true[first + k : first + k + n][: told.shape[0]])[: n - 4])
            for k in (-1, 0, 1)
            if first + k + n <= true.shape[0]
        )
        assert best < wind_mps, name
    assert log.is_sailed[5:].all()
    assert not log.has_motor_on.any()
    assert np.diff(log.t_s)[5:-5] == pytest.approx(1.0, abs=0.02)


def test_a_tlog_is_read(tmp_path):
    log = only(tlog(tmp_path / "a.tlog"))
    same(log)
    assert log.t_s[0] == pytest.approx(EPOCH_S, abs=0.1)


def test_a_voyage_folder_is_its_tlog(tmp_path):
    folder = tmp_path / "voyages" / "one"
    folder.mkdir(parents=True)
    tlog(folder / "telemetry.tlog")
    (folder / "track.csv").write_text("t_s\n")
    assert logs_under([tmp_path]) == [folder]
    same(only(folder))


def test_a_csv_is_read_in_metres_and_in_knots(tmp_path):
    same(only(table(tmp_path / "a.csv")))
    same(only(table(tmp_path / "b.csv", knots=True)))


def test_nmea_0183_is_read_and_its_variation_with_it(tmp_path):
    log = only(nmea(tmp_path / "a.nmea", spoiled=(41, 43)))
    same(log)
    assert np.nanmedian(log.stw_mps) == pytest.approx(2.0 * KNOT, abs=0.01)


def test_a_receiver_that_tells_no_course_tells_no_velocity_but_of_a_boat_that_lies(tmp_path):
    """An empty course was north."""
    path = nmea(tmp_path / "a.nmea")
    sentences = re.sub(r"(RMC,[^*\n]*?,[\d.]+,)[\d.]+(,\d{6},)[^*\n]*\*..", r"\1\2,", path.read_text())
    path.write_text(sentences)
    _, (skipped,) = read_logs([path])
    assert "the boat's speed" in skipped.why
    path.write_text(re.sub(r"(RMC,.*?[EW],)[\d.]+,", r"\g<1>0.1,", sentences))
    (read,), _ = read_logs([path])
    assert np.nanmax(np.hypot(*read.log.velocity_en_mps.T)) < 0.1


def test_a_wind_that_its_instrument_does_not_believe_is_none(tmp_path):
    """MWV with V was learned from as one with A: our own outputs write it where a vane is not believed."""
    path = nmea(tmp_path / "a.nmea")
    lines = re.sub(r"\*..$", "", path.read_text(), flags=re.MULTILINE).splitlines()
    for i, line in enumerate(lines):
        if "MWV" in line and 4 * 100 <= i < 4 * 150:
            lines[i] = "$WIMWV,170.0,R,40.0,N,V"
    path.write_text("\n".join(lines))
    log = only(path)
    assert not np.isfinite(log.aws_mps[105:148]).any()
    assert np.nanmax(log.aws_mps) < 15.0


def test_the_deviation_that_a_compass_tells_counts(tmp_path):
    """Of HDG the variation was added, and not the deviation beside it."""
    path = nmea(tmp_path / "a.nmea")
    text = re.sub(r"\*..$", "", path.read_text(), flags=re.MULTILINE)
    path.write_text(re.sub(r"(HDG,[\d.]+),,,", r"\1,5.0,W,", text))
    log = only(path)
    turned = np.angle(np.exp(1j * (log.heading_rad - LOG.heading_rad[: len(log.heading_rad)])))
    assert np.degrees(np.nanmedian(turned)) == pytest.approx(-5.0, abs=0.3)


@pytest.mark.parametrize(
    ("rmc", "hdg", "is_told"), [(True, True, True), (True, False, True), (False, True, True), (False, False, False)]
)
def test_magnetic_headings_without_a_variation_are_told(tmp_path, rmc, hdg, is_told):
    """They were true without a word, and 15 degrees of variation were the compass's."""
    path = nmea(tmp_path / "a.nmea")
    text = re.sub(r"\*..$", "", path.read_text(), flags=re.MULTILINE)  # a line without a checksum is believed
    if not rmc:
        text = re.sub(r"(RMC.*?\d{6}),2\.0,W", r"\1,,", text)
    if not hdg:
        text = re.sub(r"(HDG.*?,,),2\.0,W", r"\1,,", text)
    path.write_text(text)
    log = only(path)
    told = [note for note in log.notes if "headings are magnetic" in note]
    assert (told == []) is is_told
    off_deg = np.degrees(
        np.nanmedian(np.angle(np.exp(1j * (log.heading_rad - LOG.heading_rad[: len(log.heading_rad)]))))
    )
    assert off_deg == pytest.approx(0.0 if is_told else 2.0, abs=0.3)


def test_an_autopilot_s_own_log_is_read(tmp_path):
    path, epoch_s = bin_log(tmp_path / "1.BIN")
    log = only(path)
    same(log)
    assert log.t_s[5] == pytest.approx(epoch_s + 5.0, abs=1.1)


def test_one_of_another_release_is_skipped_with_its_column(tmp_path, monkeypatch):
    monkeypatch.setitem(FORMATS, "WIND", (134, "Qffff", "TimeUS,Dir,SpdApp,DrTru,SpdTru"))
    read, skipped = read_logs([bin_log(tmp_path / "1.BIN")[0], tlog(tmp_path / "good.tlog")])
    assert [one.log.name for one in read] == [str(tmp_path / "good.tlog")]
    assert "no column DrApp" in skipped[0].why


def test_one_that_is_cut_off_is_read_to_there(tmp_path):
    path, _ = bin_log(tmp_path / "1.BIN", cut=7777)
    log = only(path)
    assert 250 < log.t_s.shape[0] < 345
    (tmp_path / "2.BIN").write_bytes(b"\xa3\x95" + bytes(range(200)))
    read, skipped = read_logs([tmp_path / "2.BIN"])
    assert not read
    assert len(skipped) == 1


def test_a_log_without_wind_and_one_of_two_boats_are_skipped_with_a_reason(tmp_path):
    paths = [
        tlog(tmp_path / "calm.tlog", without=("AppWndSpd", "AppWndDir")),
        tlog(tmp_path / "two.tlog", second_system=7),
        table(tmp_path / "bow.csv", without=("heading_deg",)),
        tlog(tmp_path / "good.tlog"),
        tlog(tmp_path / "again.tlog"),
        tlog(tmp_path / "other.tlog", system=3),
    ]
    read, skipped = read_logs(paths)
    assert [one.log.name for one in read] == [str(tmp_path / "good.tlog")]
    why = {one.name.rpartition("/")[2]: one.why for one in skipped}
    assert "the wind" in why["calm.tlog"]
    assert "two boats, systems 1 and 7" in why["two.tlog"]
    assert "the heading" in why["bow.csv"]
    assert "the same as" in why["again.tlog"]
    assert "system 3" in why["other.tlog"]


def test_a_clock_that_jumps_is_told_by_the_autopilot_s_own(tmp_path):
    log = only(tlog(tmp_path / "a.tlog", jump_s=-5000))
    same(log)
    assert "jumps, by up to 5000 s" in log.notes[0]


def test_a_reboot_begins_another_piece(tmp_path):
    log = only(tlog(tmp_path / "a.tlog", reboot_at=200))
    assert np.all(np.diff(log.t_s) >= 0.0)
    assert log.t_s.shape[0] > 350


def test_who_lies_still_does_not_sail(tmp_path):
    """A mode in which the sheets are eased, and disarmed: both are known, second by second."""
    log = only(tlog(tmp_path / "a.tlog", held_from=150))
    assert log.is_sailed[5:145].all()
    assert not log.is_sailed[155:].any()


def test_what_is_not_there_is_refused(tmp_path):
    with pytest.raises(InputError, match="no such file"):
        logs_under([tmp_path / "nowhere"])
    read, skipped = read_logs(logs_under([Path("/dev/null")]))  # which is no folder ("Not a directory")
    assert (len(read), [left.why for left in skipped]) == (0, ["it is no file"])


@pytest.mark.parametrize("ending", ["tlog", "tlog.gz", "BIN", "csv", "csv.gz", "nmea"])
@pytest.mark.parametrize("what", ["nothing", "noise", "half"])
def test_what_is_damaged_is_skipped_or_read_to_there(tmp_path, ending, what):
    """Nothing that lies in a folder of logs ends the reading of the others."""
    makers = {"tlog": tlog, "csv": table, "nmea": nmea, "BIN": lambda path: bin_log(path)[0]}
    whole = makers[ending.removesuffix(".gz")](tmp_path / f"whole.{ending.removesuffix('.gz')}").read_bytes()
    if ending.endswith(".gz"):
        whole = gzip.compress(whole)
    noise = np.random.default_rng(1).integers(0, 256, 5000, dtype=np.uint8).tobytes()
    path = tmp_path / f"a.{ending}"
    spoiled = {"nothing": b"", "noise": noise, "half": whole[: len(whole) // 2] + noise + whole[len(whole) // 2 :]}
    path.write_bytes(spoiled[what])
    read, skipped = read_logs([path, tlog(tmp_path / "good.tlog")])
    assert str(tmp_path / "good.tlog") in [one.log.name for one in read]
    assert len(read) + len(skipped) == 2
    if what != "half":
        assert len(skipped) == 1
