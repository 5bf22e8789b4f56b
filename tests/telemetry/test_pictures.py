"""Pictures and reports: every mark in the legend, no legend over a curve, drifting told from sailing, words, tracks."""

import json
import shutil
import sys
import time
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import gpxpy
import matplotlib.pyplot as plt
import msgspec
import numpy as np
import pytest
from matplotlib.colors import to_rgba
from matplotlib.patches import Wedge

from companion import cli
from companion.clock import run_virtual
from companion.commands import output
from companion.geofence import read
from companion.planner import Problem, plan
from companion.plots import chart, mission, voyage
from companion.plots import plan as plan_picture
from companion.telemetry.folder.reading import ChartWater, read_voyage
from sitl.run.embedded import run_embedded
from sitl.scenario.scenario import ExpectSpec, Scenario, WindSpec

ROOT = Path(__file__).parents[2]
MISSIONS = ROOT / "missions"


@pytest.fixture
def drawn(monkeypatch):
    """Keep the figures that would be saved and closed."""
    kept = []

    def keep(figure, path):
        figure.canvas.draw()
        kept.append(figure)

    for module in (mission, voyage, plan_picture):
        monkeypatch.setattr(module, "save", keep)
    yield kept
    for figure in kept:
        plt.close(figure)


@pytest.fixture(scope="module")
def sailed(tmp_path_factory):
    out = tmp_path_factory.mktemp("pictures") / "v"
    scenario = Scenario(
        name="open-water", mission="open-water.toml", limit_s=150.0, wind=WindSpec(sd_deg=2.0), expect=ExpectSpec()
    )
    run_virtual(run_embedded(scenario, ROOT / "sitl/missions/scenario.toml", 1, out, expansions=2000))
    return out


def words(figure):
    """Return everything that is written in a figure, and what its legends name."""
    legends = [a.get_legend() for a in figure.axes if a.get_legend()] + list(figure.legends)
    said = [t.get_text() for a in figure.axes for t in a.texts]
    return {t.get_text() for legend in legends for t in legend.get_texts()}, said, legends


def test_the_voyages_picture(sailed, drawn, tmp_path):
    # Somebody had the boat for half a minute: that is no sailing.
    folder = tmp_path / "v"
    shutil.copytree(sailed, folder)
    lines = (folder / "track.csv").read_text().splitlines()
    lines[80:110] = [line.replace(",AUTO,", ",HOLD,") for line in lines[80:110]]
    (folder / "track.csv").write_text("\n".join(lines) + "\n")
    voyage.plot_voyage(read_voyage(folder), tmp_path / "v.png")
    names, said, _ = words(drawn[0])
    assert {
        "first plan",
        "sailed on port tack",
        "adrift, or in other hands",
        "goal and its radius",
        "first position",
        "last position",
        "no-go zone",
    } <= names
    assert "Windward mark" in said
    assert any(text.endswith(" m") for text in said)  # the scale
    title = drawn[0].get_suptitle()
    assert "9 June 2026, 10:13 UTC" in title
    assert "50°49.02' N 1°18.60' W" in title


def test_a_voyage_is_told_by_the_autopilots_clock_where_the_computers_was_another(sailed, tmp_path, capsys):
    folder = tmp_path / "v"
    shutil.copytree(sailed, folder)
    decisions = folder / "decisions.jsonl"
    first, rest = decisions.read_text().split("\n", 1)
    clock = {"t_s": json.loads(first)["t_s"], "kind": "clock", "behind_s": 86_400.0, "text": ""}
    assert json.loads(first)["kind"] == "start"
    decisions.write_text("\n".join((first, json.dumps(clock), rest)))
    assert cli.main(["report", str(folder)]) == 0
    assert "10 June 2026, 10:13 UTC" in capsys.readouterr().out
    assert read_voyage(folder).epoch_s == read_voyage(sailed).epoch_s + 86_400.0
    # of a companion that was started again the later clock says nothing of the first
    decisions.write_text("\n".join((first, first, json.dumps(clock), rest)))
    assert read_voyage(folder).epoch_s == read_voyage(sailed).epoch_s


def test_no_legend_lies_over_a_curve(sailed, drawn, tmp_path):
    voyage.plot_voyage(read_voyage(sailed), tmp_path / "v.png")
    problem = Problem.from_json(str(ROOT / "sailbench" / "problems" / "four-beat-60.json"))
    plan_picture.save_plan(problem, plan(problem, expansions=500), tmp_path / "p.png")
    for figure in drawn:
        for axes in figure.axes:
            legend = axes.get_legend()
            assert legend is not None
            assert not legend.get_window_extent().overlaps(axes.get_window_extent().padded(-2.0))


def test_the_missions_picture_names_its_goals_and_marks(drawn, tmp_path, capsys):
    assert (
        cli.main(
            ["mission", "check", str(MISSIONS / "buoy-course.toml"), "--plot", str(tmp_path / "m.png"), "--no-plan"]
        )
        == 0
    )
    assert cli.main(["fence", "check", str(MISSIONS / "buoy-course.toml"), "--plot", str(tmp_path / "f.png")]) == 0
    for figure, wanted in zip(drawn, ("mark to leave to port", "goal"), strict=True):
        names, said, _ = words(figure)
        assert {"start", wanted} <= names
        assert any("Windward" in text for text in said)
        assert "50°49." in figure.get_suptitle()


def test_the_plans_picture_tells_obstacles_from_their_margin_and_keeps_the_colours_of_its_legend(
    drawn, tmp_path, capsys
):
    """It drew obstacles grown by the margin, called them obstacles, and its no-go colours were in no legend."""
    assert (
        cli.main(
            [
                "plan",
                str(ROOT / "sitl/missions/two-channels.toml"),
                "--plot",
                str(tmp_path / "p.png"),
                "--expansions",
                "500",
                "--algorithm",
                "rrtstar",
            ]
        )
        == 0
    )
    names, said, _ = words(drawn[0])
    assert {"obstacles", "margin of 10 m: no plan enters", "no-go zone of the boat"} <= names
    assert "obstacle" not in names
    assert "West bank" in said
    axes = drawn[0].axes[0]
    legend = axes.get_legend()
    shown = {text.get_text(): handle for text, handle in zip(legend.get_texts(), legend.legend_handles, strict=True)}
    wedges = [p for p in axes.patches if isinstance(p, Wedge)]
    assert wedges
    assert {to_rgba(w.get_facecolor()) for w in wedges if w.zorder > 0.6} == {
        to_rgba(shown["no-go zone of the boat"].get_color())
    }


GATE = ROOT / "sitl/missions/tide-gate.toml"
BAR_HOURS = "The bar (drying height):\nsolid until 08:32, open until 15:00, then solid"


@pytest.mark.parametrize(
    ("at", "state", "words_of_it"),
    [
        ("2026-06-09T08:00Z", "solid", BAR_HOURS),
        ("2026-06-09T09:00Z", "open", "The bar (drying height):\nopen until 15:00, then solid"),
    ],
)
def test_a_plans_picture_draws_water_that_dries_as_it_is_then(drawn, tmp_path, capsys, at, state, words_of_it):
    words_said = ["plan", str(GATE), "--at", at, "--plot", str(tmp_path / "p.png"), "--expansions", "300"]
    cli.main(words_said)
    names, said, _ = words(drawn[0])
    assert f"dries: {state} at {at[:10]} {at[11:16]} UTC" in names
    assert words_of_it in said
    assert "kept out of while it is closed" in names
    assert not any("vessel" in name for name in names)


def test_so_does_a_missions_from_when_its_table_begins(drawn, tmp_path, capsys):
    assert cli.main(["mission", "check", str(GATE), "--no-plan", "--plot", str(tmp_path / "m.png")]) == 0
    names, said, _ = words(drawn[0])
    assert "dries: solid at 2026-06-09 05:34 UTC" in names
    assert BAR_HOURS in said


def test_so_does_a_voyages_from_its_first_moment(sailed, drawn, tmp_path):
    """By the boat's clock, which is not always the computer's: the picture's one moment is that of the first row."""
    record = read_voyage(sailed)
    began_s = record.epoch_s + float(record.columns["t_s"][0])
    bar = ChartWater(
        name="Bar", area="POLYGON ((0 0, 9000 0, 9000 40, 0 40, 0 0))", solid_unix_s=((None, began_s + 600.0),)
    )
    seen = replace(record, chart=msgspec.structs.replace(record.chart, drying=(bar,)))
    voyage.plot_voyage(seen, tmp_path / "v.png")
    names, said, _ = words(drawn[0])
    assert any(name.startswith("dries: solid at 2026-") for name in names)
    assert any(text.startswith("Bar:\nsolid until ") and text.endswith("then open") for text in said)
    assert drawn[0].axes[0].get_xlim()[1] < 4500.0, "what dries far off widens no picture"


def test_the_report_tells_the_voyage_and_writes_its_track(sailed, tmp_path, capsys):
    tracks = [tmp_path / f"t.{kind}" for kind in ("gpx", "kml", "geojson")]
    options = [part for track in tracks for part in ("--track", str(track))]
    assert cli.main(["report", str(sailed), "--out", str(tmp_path / "v.png"), *options]) == 0
    out = capsys.readouterr().out
    figures = json.loads((sailed / "summary.json").read_text())
    assert f"{figures['distance_m']:.0f} m, with" in out
    # a beat is inside the mission's zone for most of its time: which angle is meant is said
    assert figures["no_go_entry_deg"] == pytest.approx(40.0)
    assert "No-go entries, nearer to the wind than 40°, 5° inside the angle to which the autopilot beats" in out
    assert "9 June 2026" in out
    assert "None" not in out
    c = read_voyage(sailed).columns
    known = np.isfinite(c["lat_deg"])
    for track in tracks:
        found = read(track).tracks[0]
        assert len(found.points) == known.sum()
        assert found.points[-1].lat_deg == pytest.approx(c["lat_deg"][known][-1], abs=1e-7)
    times = gpxpy.parse(tracks[0].read_text()).tracks[0].segments[0].points
    assert (times[-1].time - times[0].time).total_seconds() == pytest.approx(
        c["t_s"][known][-1] - c["t_s"][known][0], abs=0.01
    )
    assert cli.main(["report", str(sailed), "--track", str(tracks[0])]) == 2  # not without --force
    assert cli.main(["report", str(sailed), "--track", str(tmp_path / "t.wkt")]) == 2
    (tmp_path / "mine.png").write_text("hello")
    assert cli.main(["report", str(sailed), "--out", str(tmp_path / "mine.png")]) == 2
    assert (tmp_path / "mine.png").read_text() == "hello"


def test_all_voyages_are_reported_and_what_lies_among_them_is_passed_over(sailed, tmp_path, capsys):
    """`companion report voyages/*`, as the guide has it, failed on the state file that lies among the voyages."""
    (tmp_path / "2-a").symlink_to(sailed)
    (tmp_path / "1-torn").mkdir()
    (tmp_path / "a.state.json").write_text("{}")
    assert cli.main(["report", *map(str, sorted(tmp_path.iterdir()))]) == 2
    out, err = capsys.readouterr()
    assert f"Picture: {tmp_path}/2-a/voyage.png" in out
    assert err.startswith(f"companion report: {tmp_path}/1-torn: track.csv: is missing")
    (tmp_path / "1-torn").rmdir()
    assert cli.main(["report", *map(str, sorted(tmp_path.iterdir()))]) == 0
    assert cli.main(["report", str(tmp_path / "a.state.json")]) == 2
    capsys.readouterr()
    assert cli.main(["report", *map(str, sorted(tmp_path.iterdir())), "--json"]) == 2
    assert "--json: is of one voyage, and 2 are named" in capsys.readouterr().err


def test_what_takes_long_says_why(monkeypatch, capsys):
    monkeypatch.setattr(output, "PATIENCE_S", 0.02)
    with output.patience("drawing"):
        time.sleep(0.2)
    assert capsys.readouterr().err == "note: still drawing\n"
    with output.patience("checking", "the area is large"):
        time.sleep(0.2)
    assert capsys.readouterr().err == "note: checking; the area is large\n"
    with output.patience("drawing"):
        pass
    time.sleep(0.05)
    assert capsys.readouterr().err == ""


def test_that_kernels_are_compiled_or_fonts_are_listed_is_said_while_that_is_so(tmp_path, monkeypatch, capsys):
    """It was said of everything that took three seconds, for ever."""
    matplotlib = SimpleNamespace(get_cachedir=lambda: str(tmp_path))
    monkeypatch.setattr(output, "PATIENCE_S", 0.02)
    monkeypatch.setitem(sys.modules, "matplotlib", matplotlib)
    begun = iter([7, 7, 7, 8, 8, 9])
    monkeypatch.setattr(output, "begun", lambda: next(begun))
    told = []
    for has_fonts in (False, True, False):
        (tmp_path / "fontlist-v390.json").unlink(missing_ok=True)
        if not has_fonts:
            (tmp_path / "fontlist-v390.json").touch()
        with output.patience("drawing", "the area is large"):
            time.sleep(0.2)
        told.append(capsys.readouterr().err)
    assert told == [
        "note: drawing; the area is large\n",
        "note: drawing; kernels are compiled and fonts are listed, once on each machine\n",
        "note: drawing; kernels are compiled, once on each machine\n",
    ]


def test_places_and_dates_in_words():
    assert chart.place_words(-33.85, 151.26) == "33°51.00' S 151°15.60' E"
    assert chart.place_words(0.999999, -0.5) == "1°00.00' N 0°30.00' W"
    assert chart.date_words("nonsense") == ""
