"""A planned passage for tests: half a degree along the equator in an ensemble, a current with it."""

import functools

from companion.passage import sweep
from companion.view.planned import planned_of
from tests.passage.test_sweep import POLAR
from tests.passage.world import HOURS, LAT, LON, T0, cube, passage, place, steady

MEMBERS = 9


@functools.cache
def planned(members=MEMBERS, max_tws_mps=99.0, stream=True):
    """Return a passage of so many members, from a fresh northerly to a light one, and what is drawn of it."""
    a, b = place(0.0, 0.0), place(0.0, 0.5)
    winds = [steady(0.0, -9.0 + 0.5 * k) for k in range(members)]
    asked = passage(
        a,
        b,
        polar=POLAR,
        wind=cube(LAT, LON, HOURS, winds),
        stream=cube(LAT, LON, HOURS, steady(0.3, 0.1)) if stream else None,
        radius_m=500.0,
        max_tws_mps=max_tws_mps,
    )
    [found] = sweep(asked, [T0], 0.1, nodes=14, candidates=2)
    return asked, found, planned_of(asked, found.route, "along the line", found, version="1")
