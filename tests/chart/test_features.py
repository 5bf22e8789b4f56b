"""Which features of a chart are solid, for a boat that needs two metres."""

import pytest
import shapely
from shapely.geometry import MultiPoint, Point, box

from companion.chart import Row, Wanted, s57, tags
from companion.errors import InputError

WANTED = Wanted(safety_depth_m=2.0, air_draft_m=5.0)
AREA, POINT = box(0, 0, 1, 1), Point(0.5, 0.5)


def reasons(layer, geometry=AREA, wanted=WANTED, **attributes):
    row = Row(layer=layer, place="", geometry=geometry, attributes=attributes)
    return [d.reason for d in s57.dangers_of(row, wanted)]


@pytest.mark.parametrize(
    ("layer", "attributes", "told"),
    [
        ("LNDARE", {}, ["land"]),
        ("UNSARE", {}, ["not surveyed"]),
        ("DEPARE", {"DRVAL1": 5.0}, []),
        ("DEPARE", {"DRVAL1": 2.0}, []),
        ("DEPARE", {"DRVAL1": 1.8}, ["shallow"]),
        ("DEPARE", {"DRVAL1": -1.1}, ["dries"]),
        ("DEPARE", {"DRVAL1": float("nan")}, ["no depth told"]),
        ("DRGARE", {"DRVAL1": 1.0}, ["shallow"]),
        ("WRECKS", {"VALSOU": 13.0}, []),
        ("WRECKS", {"VALSOU": 1.0}, ["wreck"]),
        ("WRECKS", {"CATWRK": 2}, ["wreck"]),
        ("WRECKS", {"CATWRK": 1}, []),
        ("WRECKS", {"CATWRK": 1, "VALSOU": 1.0}, ["wreck"]),
        ("UWTROC", {}, ["rock"]),
        ("OBSTRN", {"VALSOU": 4.5}, []),
        ("BOYLAT", {}, ["buoy"]),
        ("BCNSPP", {}, ["beacon"]),
        ("PILPNT", {}, ["pile"]),
        ("BRIDGE", {"VERCLR": 20.0}, []),
        ("BRIDGE", {"VERCLR": 4.0}, ["bridge"]),
        ("BRIDGE", {"VERCOP": 20.0}, ["bridge"]),
        ("BRIDGE", {"VERCLR": 20.0, "VERCCL": 3.0}, ["bridge"]),
        ("RESARE", {"RESTRN": "14,7"}, ["entry prohibited"]),
        ("RESARE", {"RESTRN": "1"}, []),
        ("SEAARE", {}, []),
    ],
)
def test_a_class_of_s57(layer, attributes, told):
    assert reasons(layer, **attributes) == told


def test_bridges_are_solid_where_nobody_says_how_high_she_is():
    assert reasons("BRIDGE", wanted=Wanted(safety_depth_m=2.0), VERCLR=60.0) == ["bridge"]


def test_restricted_areas_are_by_choice():
    for choice, told in (("none", 0), ("prohibited", 1), ("all", 2)):
        wanted = Wanted(safety_depth_m=2.0, restricted=choice)
        rows = [Row(layer="RESARE", place="", geometry=AREA, attributes={"RESTRN": r}) for r in ("7", "1")]
        assert sum(len(s57.dangers_of(row, wanted)) for row in rows) == told


def test_soundings_are_solid_one_by_one():
    points = MultiPoint([(0.1, 0.1, 5.0), (0.2, 0.2, 1.9), (0.3, 0.3, -0.5)])
    (shoal, dry) = s57.dangers_of(Row(layer="SOUNDG", place="", geometry=points), WANTED)
    assert [(d.depth_m, d.geometry.x, d.radius_m) for d in (shoal, dry)] == [(1.9, 0.2, 5.0), (-0.5, 0.3, 5.0)]


def cell(*rows, **dsid):
    header = {"DSPM_HDAT": 2, "DSPM_DUNI": 1, "DSPM_CSCL": 12000, "DSID_EDTN": "4", "DSID_UPDN": "2", **dsid}
    return [
        Row(layer="DSID", place="", geometry=shapely.Point(), attributes=header),
        *(Row(layer=layer, place="", geometry=geometry, attributes=a) for layer, geometry, a in rows),
    ]


DEEP = ("DEPARE", AREA, {"DRVAL1": 10.0})


def test_a_cell_says_its_edition_scale_and_coverage():
    chart = s57.chart_of(
        cell(DEEP, ("M_COVR", box(0, 0, 0.5, 1), {"CATCOV": 1}), DSID_ISDT="20260102"), "a/X.000", WANTED
    )
    assert str(chart.source) == "a/X.000 edition 4.2 of 2026-01-02"
    assert (chart.resolution_m, chart.supersedes, chart.knows_depths) == (6.0, True, True)
    assert chart.coverage.equals(box(0, 0, 0.5, 1))


@pytest.mark.parametrize(("zone", "doubt_m"), [(1, 5.0), (2, 20.0), (3, 50.0), (4, 60.0), (6, 60.0), (None, 60.0)])
def test_the_surveys_quality_widens_margins_of_what_is_under_water(zone, doubt_m):
    quality = [("M_QUAL", AREA, {"CATZOC": zone})] if zone else []
    rows = cell(DEEP, ("UWTROC", POINT, {}), ("LNDARE", box(0, 0, 0.1, 0.1), {}), *quality)
    chart = s57.chart_of(rows, "X.000", Wanted(safety_depth_m=2.0, most_doubt_m=60.0))
    assert {d.reason: d.doubt_m for d in chart.dangers} == {"rock": doubt_m, "land": 0.0}


def test_of_two_zones_of_quality_the_worse_counts():
    zones = [("M_QUAL", AREA, {"CATZOC": 1}), ("M_QUAL", box(0.4, 0.4, 1, 1), {"CATZOC": 3})]
    (danger,) = s57.chart_of(cell(DEEP, ("UWTROC", POINT, {}), *zones), "X.000", WANTED).dangers
    assert danger.doubt_m == 50.0


@pytest.mark.parametrize(
    ("header", "told"),
    [
        ({"DSPM_HDAT": 89}, "X.000: DSID: its horizontal datum (HDAT 89) is not WGS 84; take an edition in WGS 84"),
        ({"DSPM_DUNI": 2}, "X.000: DSID: its depths are in fathoms and feet; take an edition in metres"),
        ({"DSPM_DUNI": 3}, "X.000: DSID: its depths are in feet; take an edition in metres"),
    ],
)
def test_a_header_that_is_not_to_be_believed_is_refused(header, told):
    with pytest.raises(InputError) as refused:
        s57.chart_of(cell(DEEP, **header), "X.000", WANTED)
    assert str(refused.value) == told


@pytest.mark.parametrize(
    ("attributes", "told"),
    [
        ({"natural": "coastline"}, [("shore", 10.0)]),
        ({"man_made": "pier"}, [("pier", 10.0)]),
        ({"other_tags": '"seamark:type"=>"rock","seamark:rock:water_level"=>"covers"'}, [("rock", 10.0)]),
        ({"seamark:type": "wreck", "seamark:wreck:depth": "12"}, []),
        ({"seamark:type": "wreck", "seamark:wreck:depth": "1.5"}, [("wreck", 20.0)]),
        ({"seamark:type": "wreck", "seamark:wreck:depth": "12 ft"}, [("wreck", 20.0)]),
        ({"seamark:type": "buoy_lateral"}, [("buoy", 10.0)]),
        ({"seamark:type": "beacon_special_purpose"}, [("beacon", 10.0)]),
        ({"natural": "wood"}, []),
        ({"natural": "reef", "depth": "12"}, []),
        ({"seamark:type": "pile", "depth": "12"}, [("pile", 10.0)]),  # these stand in water of that depth
        ({"man_made": "pier", "depth": "12"}, [("pier", 10.0)]),
        ({"seamark:type": "platform", "seamark:platform:depth": "30"}, [("platform", 10.0)]),
        ({"seamark:type": "mooring", "depth": "12"}, [("mooring", 10.0)]),
    ],
)
def test_a_tag_of_openstreetmap(attributes, told):
    row = Row(layer="points", place="", geometry=POINT, attributes=attributes)
    assert [(d.reason, d.radius_m) for d in tags.dangers_of(row, WANTED)] == told
