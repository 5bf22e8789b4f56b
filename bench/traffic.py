"""What other vessels cost: 200 of them, 60 messages a minute each, for a minute, in CPU seconds.

    python -m bench.traffic                       200 vessels; a share of one core, by process time
    python -m bench.traffic --vessels 50

Sentences are made beforehand. Counted are: a UDP feed's datagrams decoded and folded into tracks; the lookout's
judgement of every vessel each second; and what the skipper does each second with those that are near (twelve at most):
their discs, and the route held against them.
"""

from __future__ import annotations

import argparse
import asyncio
import math
import time

import numpy as np
from pyais.encode import encode_dict

from companion.clock import now_s, run_virtual
from companion.geo.frame import LocalFrame
from companion.messages import GeoPoint
from companion.traffic import LAKE, OwnShip, Targets, assess, check_legs, planning_discs
from companion.traffic.feeds import AisFeed, parse_feed
from companion.traffic.occupancy import Keep
from companion.traffic.plans import PlainLeg

SECONDS = 60
NEAREST = 12
FRAME = LocalFrame(GeoPoint(lat_deg=50.8, lon_deg=-1.3))
ROUTE = [
    PlainLeg(
        from_en=(300.0 * i, 0.0), to_en=(300.0 * i + 300.0, 100.0 * (i % 2)), start_s=150.0 * i, end_s=150.0 * i + 150.0
    )
    for i in range(8)
]


def sentences(vessels: int) -> list[list[bytes]]:
    """Return for each second a datagram from each vessel."""
    rng = np.random.default_rng(7)
    places, courses = rng.uniform(-8000.0, 8000.0, (vessels, 2)), rng.uniform(0.0, 360.0, vessels)
    speeds = rng.uniform(1.0, 12.0, vessels)
    out = []
    for t in range(SECONDS):
        row = []
        for i in range(vessels):
            run, c = float(speeds[i]) * t, math.radians(float(courses[i]))
            point = FRAME.geo_from_en(float(places[i, 0]) + run * math.sin(c), float(places[i, 1]) + run * math.cos(c))
            values = {
                "type": 1,
                "mmsi": 211000000 + i,
                "lat": point.lat_deg,
                "lon": point.lon_deg,
                "course": courses[i],
                "speed": speeds[i] * 1.944,
                "heading": int(courses[i]),
            }
            row.append(encode_dict(values, talker_id="AI", sentence_type="VDM")[0].encode())
        out.append(row)
    return out


async def minute(said: list[list[bytes]]) -> dict[str, float]:
    """Return the CPU seconds of each part."""
    spent = dict.fromkeys(("decoded and tracked", "judged", "near ones planned for"), 0.0)
    targets = Targets.empty(FRAME)
    heard: list = []
    feed = AisFeed(parse_feed("udpin:0.0.0.0:10110"), heard.append)
    for t, row in enumerate(said):
        await asyncio.sleep(t - now_s())
        began = time.process_time()
        for datagram in row:
            feed.datagram(datagram)
        for report in heard:
            targets = targets.heard(report)
        heard.clear()
        picture = targets.picture(float(t))
        spent["decoded and tracked"] += time.process_time() - began
        began = time.process_time()
        own = OwnShip(t_s=float(t), en_m=(2.0 * t, 0.0), velocity_en_mps=(2.0, 0.0), heading_rad=math.pi / 2)
        found = assess(own, picture, LAKE, 0.0)
        spent["judged"] += time.process_time() - began
        began = time.process_time()
        discs = planning_discs([a.vessel for a in found[:NEAREST]], float(t), Keep(horizon_s=600.0))
        check_legs(ROUTE, discs)
        spent["near ones planned for"] += time.process_time() - began
    assert len(picture.vessels) == len(said[0])
    return spent


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--vessels", type=int, default=200)
    args = parser.parse_args()
    spent = run_virtual(minute(sentences(args.vessels)))
    for name, seconds in spent.items():
        print(f"{name:24s} {seconds:6.2f} CPU s of {SECONDS} s: {100.0 * seconds / SECONDS:5.2f} % of a core")
    total = sum(spent.values())
    print(f"{'together':24s} {total:6.2f} CPU s of {SECONDS} s: {100.0 * total / SECONDS:5.2f} % of a core")


if __name__ == "__main__":
    main()
