"""What is read of a mission: which files are drawn in, which are shown only and why, and what is refused."""

import shutil
from pathlib import Path

import pytest

from companion.cli import main
from companion.editor import read_base
from companion.editor.desk import state_of
from companion.editor.draft import draft_of
from companion.editor.sketch import MOST_VERTICES
from companion.errors import InputError
from companion.geofence import load_mission

MISSION = '[start]\nlat = 50.817\nlon = -1.31\n[[goal]]\nlat = 50.82\nlon = -1.31\n[area]\nobstacles = ["{}"]\n{}'
SQUARE = "POLYGON ((-1.312 50.818, -1.311 50.818, -1.311 50.819, -1.312 50.819, -1.312 50.818))\n"


def written(folder, name, text=SQUARE, more=""):
    (folder / name).write_text(text)
    path = folder / "m.toml"
    path.write_text(MISSION.format(name, more))
    return path


def why_locked(path):
    base = read_base(path)
    assert not base.grounds
    assert state_of(base)["locked"]  # it is shown
    assert state_of(base)["files"][0]["why"] == base.locked[0].why
    draft = draft_of(base, base.sketch())
    assert list(draft.files.values()) == [path.read_bytes()]  # and never written
    return base.locked[0].why


# Their drawings go on past 180 degrees: shown and kept, not edited.
OVER_THE_DATE_LINE = {"date-line", "ocean"}


MISSIONS = sorted([*Path("missions").glob("*.toml"), *Path("sitl/missions").glob("*.toml")])


@pytest.mark.parametrize("path", MISSIONS, ids=lambda p: p.stem)
def test_every_example_is_drawn_and_its_draft_is_itself(path, tmp_path):
    shutil.copytree(path.parent, tmp_path / "m")
    path = tmp_path / "m" / path.name
    base = read_base(path)
    assert bool(base.locked) == (path.stem in OVER_THE_DATE_LINE)
    assert all("beyond ±180" in drawing.why for drawing in base.locked)
    for name, data in draft_of(base, base.sketch()).files.items():
        assert data == name.read_bytes()
    assert len(base.sketch().goals) == len(load_mission(path).goals)


def test_files_that_are_shown_and_not_edited(tmp_path):
    path = written(
        tmp_path,
        "a.wkt",
        more='axis = "latlon"\n',
        text=("POLYGON ((50.818 -1.312, 50.818 -1.311, 50.819 -1.311, 50.819 -1.312, 50.818 -1.312))\n"),
    )
    assert "latitude first" in why_locked(path)
    path = written(tmp_path, "a.wkt")
    assert main(["fence", "convert", str(tmp_path / "a.wkt"), str(tmp_path / "a.kml")]) == 0
    path.write_text(MISSION.format("a.kml", ""))
    assert "kml file" in why_locked(path)
    (tmp_path / "sub").mkdir()
    outside = tmp_path / "sub" / "m.toml"
    outside.write_text(MISSION.format("../a.wkt", ""))
    assert "outside" in why_locked(outside)
    (tmp_path / "link.wkt").symlink_to(tmp_path / "a.wkt")
    path.write_text(MISSION.format("link.wkt", ""))
    assert "link" in why_locked(path)
    (tmp_path / "latin.wkt").write_bytes("é|exclusion|".encode("latin-1") + SQUARE.encode())
    path.write_text(MISSION.format("latin.wkt", ""))
    assert "UTF-8" in why_locked(path)
    rocks = "\n".join(f"POINT (-1.31 {50.83 + 1e-6 * n:.6f})" for n in range(MOST_VERTICES + 1))
    assert "vertices" in why_locked(written(tmp_path, "coast.wkt", rocks))


def test_line_ends_and_marks_of_windows_stay(tmp_path):
    path = written(tmp_path, "a.wkt")
    path.write_bytes(b"\xef\xbb\xbf" + path.read_bytes().replace(b"\n", b"\r\n"))
    (tmp_path / "a.wkt").write_bytes(SQUARE.replace("\n", "\r\n").encode())
    base = read_base(path)
    assert all(data == name.read_bytes() for name, data in draft_of(base, base.sketch()).files.items())


def test_a_ring_that_crosses_itself_is_told_before_it_is_drawn(tmp_path):
    path = written(tmp_path, "a.wkt", "POLYGON ((-1.312 50.818, -1.311 50.819, -1.311 50.818, -1.312 50.819))\n")
    assert len(read_base(path).sketch().shapes[0].rings[0]) == 4  # it is there, to be mended
    with pytest.raises(InputError, match="ring"):
        load_mission(path)


def test_a_file_that_is_named_twice_or_not_there(tmp_path):
    path = written(tmp_path, "a.wkt", more='fence = "a.wkt"\n')
    with pytest.raises(InputError, match="named twice"):
        read_base(path)
    path.write_text(MISSION.format("gone.wkt", ""))
    with pytest.raises(InputError, match="no such file"):
        read_base(path)
