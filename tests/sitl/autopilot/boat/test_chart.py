"""The chart that hull, mission and fence of the simulated boat share."""

from __future__ import annotations

from companion.geo.frame import LocalFrame
from companion.messages import GeoPoint
from sitl.autopilot.boat.vehicle import HomeChart

HOME = GeoPoint(lat_deg=50.817, lon_deg=-1.31)


def test_a_place_is_converted_once_for_all_who_tell_it_or_look_at_it(monkeypatch):
    chart, asked, work = HomeChart(HOME), [], LocalFrame.geo_from_en
    monkeypatch.setattr(LocalFrame, "geo_from_en", lambda self, *en: asked.append(en) or work(self, *en))
    here = chart.point((30.0, 40.0))
    assert chart.point((30.0, 40.0)) is here
    assert chart.to_e7((30.0, 40.0)) == (round(here.lat_deg * 1e7), round(here.lon_deg * 1e7))
    assert asked == [(30.0, 40.0)]
    chart.follow((500.0, 0.0))
    assert chart.point((30.0, 40.0)) != here
