"""A changed copy of a frozen value is what dataclasses.replace makes, in less time."""

from dataclasses import dataclass, field, replace

import pytest

from companion.frozen import changed
from companion.messages import AutopilotStatus, GeoPoint, Mode
from companion.skipper import SkipperState
from companion.skipper.step.state import LoadedMission, Phase


@pytest.mark.parametrize(
    ("value", "changes"),
    [
        (AutopilotStatus(t_s=1.0), {"mode": Mode.AUTO, "t_s": 2.0}),
        (SkipperState(), {"phase": Phase.STANDARD, "why": "away", "wants": ("wind",)}),
        (GeoPoint(lat_deg=1.0, lon_deg=2.0), {"lat_deg": 3.0}),
    ],
)
def test_it_is_what_replace_makes(value, changes):
    new = changed(value, **changes)
    assert new == replace(value, **changes)
    assert hash(new) == hash(replace(value, **changes))
    assert value != new


def test_what_holds_already_is_no_new_value():
    mission = LoadedMission()
    assert changed(mission, index=0, route=None) is mission
    assert changed(mission, index=1) is not mission


def test_a_copy_is_frozen_and_leaves_the_first_as_it_was():
    mission = LoadedMission()
    new = changed(mission, index=5)
    assert (mission.index, new.index) == (0, 5)
    with pytest.raises(AttributeError):
        new.index = 6


@pytest.mark.parametrize("value", [SkipperState(), AutopilotStatus(t_s=0.0)])
def test_a_field_that_is_not_there_is_refused(value):
    with pytest.raises(TypeError, match="no speed"):
        changed(value, speed=1.0)


def test_a_checked_value_is_checked_again():
    with pytest.raises(ValueError, match="latitude"):
        changed(GeoPoint(lat_deg=1.0, lon_deg=2.0), lat_deg=95.0)


def test_a_value_with_parts_of_its_own_is_refused():
    @dataclass(frozen=True)
    class Odd:
        a: int
        b: int = field(init=False, default=2)

    with pytest.raises(TypeError, match="by dataclasses"):
        changed(Odd(1), a=2)
