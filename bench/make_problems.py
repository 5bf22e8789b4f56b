"""Make the planner's problem set: `python bench/make_problems.py` writes sailbench/problems/*.json, always the same."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import shapely
from shapely.geometry import LineString, Point, Polygon, box

OUT = Path(__file__).resolve().parents[1] / "sailbench" / "problems"
# Büsser 2009, equation 4.1, sampled: AVALON's polar at a fresh breeze, shape only (metres a second).
AVALON = {
    "model": "polar",
    "twa_deg": [0, 40, 45, 60, 75, 90, 110, 130, 150, 160, 180],
    "v_mps": [0, 1.1, 1.35, 1.75, 1.95, 2.05, 2.1, 2.0, 1.75, 1.6, 1.3],
}
CONSTANT = {"model": "constant", "v_mps": 1.5}
BOAT = {"no_go_half_deg": 45.0, "max_twa_deg": 180.0, "turn_rate_rad_s": 0.5, "speed": CONSTANT}
SHIP = {"no_go_half_deg": 45.0, "max_twa_deg": 160.0, "turn_rate_rad_s": 0.3, "speed": AVALON}
NONE = {"model": "none"}


def kalman(s0, growth):
    return {"model": "kalman", "sigma0_deg": s0, "growth_deg_per_sqrt_s": growth}


def ar1(s0, s_inf, rho):
    return {"model": "ar1", "sigma0_deg": s0, "sigma_inf_deg": s_inf, "rho_hz": rho}


def wkt(g):
    return shapely.to_wkt(g, rounding_precision=3)


def write(
    name, title, start, goal, obstacles=(), fence=None, wind_from=0.0, sigma=NONE, boat=BOAT, delta=0.6, expect="path"
):
    problem = {
        "id": name,
        "title": title,
        "start": dict(zip(("x", "y", "heading_deg"), start, strict=True)),
        "goal": dict(zip(("x", "y", "radius"), goal, strict=True)),
        "obstacles": [wkt(g) for g in obstacles],
        "fence": None if fence is None else wkt(fence),
        "wind": {"from_deg": wind_from, "speed_mps": 6.0, "sigma": sigma},
        "boat": boat,
        "delta_s": delta,
        "expect": expect,
    }
    (OUT / f"{name}.json").write_text(json.dumps(problem, indent=1) + "\n", encoding="utf-8")


def islands(rng, count, extent, keep_clear, size=(8.0, 30.0)):
    found = []
    while len(found) < count:
        x, y = rng.uniform(0, extent[0]), rng.uniform(0, extent[1])
        n = int(rng.integers(5, 14))
        a = np.sort(rng.uniform(0, 2 * math.pi, n))
        r = rng.uniform(*size) * rng.uniform(0.6, 1.0, n)
        g = Polygon(np.column_stack([x + r * np.cos(a), y + r * np.sin(a)])).buffer(0)
        if g.geom_type != "Polygon" or g.area < 50.0 or any(g.distance(Point(c)) < 25.0 for c in keep_clear):
            continue
        found.append(g)
    return found


def coast(rng, n, length, base, rough, scales):
    x = np.linspace(0, length, n)
    y = np.full(n, base, float)
    for k in scales:
        y += rough / k * np.sin(2 * math.pi * k * x / length + rng.uniform(0, 6.3)) * rng.uniform(0.6, 1.4)
    y += np.convolve(rng.normal(0, rough / 6, n), np.ones(9) / 9, mode="same")
    return x, y


def main():
    OUT.mkdir(exist_ok=True)
    r = np.random.default_rng
    write("open-beat", "Open water, goal dead up wind", (0, 0, 90), (0, 400, 5))
    write("open-reach", "Open water, goal abeam", (0, 0, 0), (500, 60, 5), boat=SHIP)
    write("open-run", "Open water, goal dead down wind, deepest course 160", (0, 0, 200), (20, -600, 8), boat=SHIP)
    write(
        "open-beat-kalman",
        "Open water beat under growing uncertainty",
        (0, 0, 60),
        (80, 500, 5),
        delta=0.75,
        sigma=kalman(4, 0.5),
    )
    write(
        "leg-20nm",
        "20 nautical miles up wind, uncertainty levels out",
        (0, 0, 45),
        (4000, 36800, 50),
        delta=0.8,
        sigma=ar1(2, 9, 0.002),
        boat=SHIP,
    )
    sea = islands(r(5), 14, (9000, 30000), [(0, 0), (6000, 36000)], size=(300, 1500))
    write(
        "leg-20nm-islands",
        "20 nautical miles past islands, reaching and beating",
        (0, 0, 45),
        (6000, 36000, 50),
        sea,
        sigma=ar1(3, 8, 0.001),
        delta=0.7,
        boat=SHIP,
        wind_from=40,
    )
    quad = [
        box(-70, 60, -15, 110),
        box(15, 70, 65, 120),
        box(-60, 150, -8, 205),
        Polygon([(12, 160), (60, 150), (70, 200), (20, 215)]),
    ]
    write(
        "four-beat-60",
        "Four polygons, up wind, 60 %",
        (0, 0, 0),
        (0, 260, 5),
        quad,
        box(-110, -30, 110, 300),
        sigma=kalman(3, 0.8),
        delta=0.60,
    )
    write(
        "four-beat-75",
        "Four polygons, up wind, 75 %, fast growing variance",
        (0, 0, 0),
        (0, 260, 5),
        quad,
        box(-110, -30, 110, 300),
        sigma=kalman(5, 2.2),
        delta=0.75,
        expect="any",
    )
    write(
        "four-run",
        "Four polygons, down wind",
        (0, 260, 180),
        (0, 0, 5),
        quad,
        box(-110, -30, 110, 300),
        sigma=kalman(3, 0.8),
        delta=0.66,
    )
    wall = [box(-200, 150, -62, 260), box(-50, 150, 40, 260), box(100, 150, 200, 260)]
    for name, s in (("still", kalman(1, 0.05)), ("noisy", kalman(6, 0.9))):
        write(
            f"channels-{name}",
            f"Two channels, {name} wind",
            (-40, 0, 0),
            (-40, 400, 5),
            wall,
            box(-200, -40, 200, 440),
            sigma=s,
            delta=0.7,
        )
    square, roundel = box(60, 80, 140, 160), Point(40, 250).buffer(45, quad_segs=16)
    for name, wind in (("beat", 0), ("reach", 80), ("run", 175)):
        write(
            f"avalon-{name}",
            f"AVALON's square and round obstacle, {name}",
            (100, 0, 0),
            (80, 340, 8),
            [square, roundel],
            box(-80, -40, 260, 400),
            wind_from=wind,
            boat=SHIP,
        )
    left, right = LineString([(0, 0), (0, 700)]), LineString([(40, 0), (40, 700)])
    write(
        "channel-beat",
        "A straight channel 40 m wide to be beaten through",
        (20, -30, 20),
        (20, 740, 8),
        [left.buffer(6), right.buffer(6).union(box(40, 0, 300, 20))],
        box(-150, -80, 300, 800),
        sigma=ar1(2, 5, 0.01),
        delta=0.7,
    )
    bend = LineString([(0, 0), (30, 180), (-20, 360), (60, 560)])
    banks = bend.buffer(60).difference(bend.buffer(11, cap_style="flat")).intersection(box(-120, 5, 160, 540))
    write(
        "channel-bend",
        "A bending channel 22 m wide, up wind",
        (0, -20, 0),
        (62, 585, 6),
        list(shapely.get_parts(banks)),
        box(-200, -60, 220, 640),
        boat={**BOAT, "turn_rate_rad_s": 0.8},
    )
    write(
        "channel-bend-kalman",
        "The bending channel with growing uncertainty",
        (0, -20, 0),
        (62, 585, 6),
        list(shapely.get_parts(banks)),
        box(-200, -60, 220, 640),
        boat={**BOAT, "turn_rate_rad_s": 0.8},
        sigma=kalman(2, 0.25),
        delta=0.65,
    )
    trap = LineString([(-120, 60), (-130, 300), (130, 300), (120, 60)]).buffer(8, cap_style="flat")
    write(
        "trap-beat",
        "A bay that opens towards the start, goal up wind behind it",
        (0, 100, 0),
        (10, 420, 6),
        [trap],
        boat=SHIP,
        sigma=ar1(2, 6, 0.01),
        delta=0.7,
    )
    t = np.linspace(0.0, 3.6 * math.pi, 90)
    spiral = LineString(np.column_stack([(40 + 16 * t) * np.cos(t), (40 + 16 * t) * np.sin(t)])).buffer(6)
    write("trap-spiral", "Out of a spiral", (0, 0, 90), (330, 60, 6), [spiral], box(-330, -330, 400, 330), wind_from=30)
    comb = [box(-200, 80 * k, 60, 80 * k + 15) if k % 2 else box(-60, 80 * k, 200, 80 * k + 15) for k in range(1, 7)]
    write(
        "slalom",
        "Six walls, gaps left and right in turn",
        (0, 0, 0),
        (0, 620, 6),
        comb,
        box(-120, -40, 120, 680),
        wind_from=20,
    )
    write(
        "gate",
        "A gap of 2 m in a long wall, up wind",
        (-150, 0, 0),
        (60, 420, 6),
        [box(-800, 200, 39, 215), box(41, 200, 800, 215)],
        box(-800, -200, 800, 700),
    )
    clear = [(10, 10), (1190, 1190)]
    write(
        "islands-200-beat",
        "Two hundred islands, up wind",
        (10, 10, 45),
        (1190, 1190, 10),
        islands(r(11), 200, (1200, 1200), clear),
        box(-60, -60, 1260, 1260),
        wind_from=40,
        sigma=ar1(2, 6, 0.003),
        delta=0.7,
    )
    write(
        "islands-400-run",
        "Four hundred islands, down wind",
        (10, 10, 45),
        (1990, 1990, 10),
        islands(r(12), 400, (2000, 2000), [(10, 10), (1990, 1990)]),
        wind_from=230,
        boat=SHIP,
    )
    write(
        "islands-300-kalman",
        "Three hundred islands, growing uncertainty",
        (10, 10, 0),
        (1190, 1190, 10),
        islands(r(13), 300, (1200, 1200), clear, size=(5, 22)),
        wind_from=345,
        sigma=kalman(3, 0.15),
        delta=0.7,
    )
    write(
        "islands-150-dense",
        "A dense archipelago, dead up wind",
        (300, 5, 0),
        (300, 795, 8),
        islands(r(14), 150, (600, 800), [(300, 5), (300, 795)], size=(10, 34)),
        box(-40, -40, 640, 840),
    )
    x, y = coast(r(21), 5000, 9000, 0, 420, (2, 3, 5, 9, 17, 33, 71))
    land = Polygon([*zip(x, y, strict=True), (9000, -3000), (0, -3000)]).buffer(0)
    top = float(np.max(y))
    for name, wind in (("beat", 95), ("reach", 10)):
        write(
            f"coast-5000-{name}",
            f"Along a coast of 5,000 vertices, {name}",
            (200, float(np.interp(200, x, y)) + 25, 90),
            (8800, float(np.interp(8800, x, y)) + 30, 15),
            [land],
            box(0, -3000, 9000, top + 800),
            wind_from=wind,
            boat=SHIP,
            sigma=ar1(3, 7, 0.002),
            delta=0.65,
        )
    xs, low = coast(r(22), 1200, 4000, -130, 160, (1, 2, 5, 11, 29))
    _, noise = coast(r(23), 1200, 4000, 0, 60, (3, 7, 19))
    high = low + 210 + np.abs(noise)
    fjord = Polygon([*zip(xs, low, strict=True), *zip(xs[::-1], high[::-1], strict=True)]).buffer(0)
    write(
        "fjord-beat",
        "Beating up a fjord of 2,400 vertices",
        (60, float(low[18] + high[18]) / 2, 90),
        (3940, float(low[-18] + high[-18]) / 2, 15),
        [],
        fjord,
        wind_from=85,
        sigma=kalman(2, 0.06),
        delta=0.7,
    )
    ring = Point(0, 300).buffer(60).difference(Point(0, 300).buffer(45))
    write("walled-goal", "The goal is walled in", (0, 0, 0), (0, 300, 5), [ring], expect="infeasible")
    write(
        "split-fence",
        "A wall across the whole fence",
        (0, 0, 0),
        (0, 300, 5),
        [box(-400, 140, 400, 150)],
        box(-200, -50, 200, 350),
        expect="infeasible",
    )
    write(
        "noise-closes",
        "The uncertainty closes the wind's eye before the goal",
        (0, 0, 0),
        (0, 3000, 5),
        sigma=kalman(5, 1.5),
        delta=0.85,
        expect="infeasible",
    )
    write(
        "goal-ashore",
        "The goal is inside an obstacle",
        (0, 0, 0),
        (0, 300, 5),
        [box(-40, 260, 40, 340)],
        expect="invalid",
    )
    write(
        "start-ashore",
        "The start is outside the fence",
        (0, -80, 0),
        (0, 300, 5),
        [],
        box(-200, -50, 200, 350),
        expect="invalid",
    )


if __name__ == "__main__":
    main()
