"""Views as other displays are told of them, made by hand."""

from dataclasses import replace

import pytest

from companion.addresses import Displays, parse_nmea, parse_signalk
from companion.geo.frame import LocalFrame
from companion.guard import Guard
from companion.messages import GeoPoint
from companion.outputs import checked_displays
from companion.view.values import BoatView, GoalView, LegView, PlanView, PolarView, StateView, View, WindView

ORIGIN = GeoPoint(lat_deg=50.8170, lon_deg=-1.3100)


@pytest.fixture(scope="session")
def frame():
    return LocalFrame(ORIGIN)


def chosen(nmea=(), signalk=(), token_file=None, guard=None):
    """Return whom to tell, by their names."""
    return checked_displays(
        Displays(nmea=tuple(map(parse_nmea, nmea)), signalk=tuple(map(parse_signalk, signalk)), token_file=token_file),
        guard or Guard(),
    )


def view_of(**changes):
    """A boat 40 m along a leg of 100 m to the north east, 5 m right of it, close-hauled on starboard."""
    legs = (
        LegView(from_en_m=(0.0, 0.0), to_en_m=(60.0, 80.0)),
        LegView(from_en_m=(60.0, 80.0), to_en_m=(160.0, 80.0)),
        LegView(from_en_m=(160.0, 80.0), to_en_m=(160.0, 80.0), is_loiter=True),
    )
    at = (24.0 + 4.0, 32.0 - 3.0)
    here = LocalFrame(ORIGIN).geo_from_en(*at)
    whole = View(
        source="live",
        name="t",
        t_s=100.0,
        age_s=0.2,
        state=StateView(phase="standard", is_sailing=True, mode="AUTO", is_armed=True),
        boat=BoatView(
            age_s=0.2,
            lat_deg=here.lat_deg,
            lon_deg=here.lon_deg,
            at_en_m=at,
            heading_deg=35.0,
            cog_deg=36.87,
            sog_mps=1.5,
            roll_deg=12.0,
            vmg_mps=1.0,
        ),
        wind=WindView(
            health="good", age_s=0.5, twd_from_deg=80.0, tws_mps=5.0, twa_deg=45.0, awa_deg=36.0, aws_mps=6.1
        ),
        polar=PolarView(
            name="p",
            tws_mps=5.0,
            twa_deg=(0.0, 40.0, 50.0, 180.0),
            speed_mps=(0.0, 1.0, 2.0, 2.0),
            beat_deg=46.0,
            run_deg=150.0,
        ),
        plan=PlanView(number=3, leg=2, count=4, legs=legs),
        goals=(GoalView(name="North mark", kind="point", at_en_m=(160.0, 80.0)),),
    )
    return replace(whole, **changes)


@pytest.fixture
def view():
    return view_of()
