"""The maker of the table of rated yachts, on certificates that are made by a law: it finds the law."""

import json
import math
import sys

import numpy as np
import pytest

from bench import orc_shape
from companion.boat.guess import GRAVITY_MPS2, SAIL, WATER_KGPM3, WEIGHT
from companion.geo import MPS_PER_KNOT

SAIL_POWER, WEIGHT_POWER = 0.4, -0.2


def certificate(rng, number):
    length = float(rng.uniform(6.0, 25.0))
    sail, weight = (float(math.exp(0.2 * rng.standard_normal())) for _ in range(2))
    fast = math.sqrt(GRAVITY_MPS2 * length) / MPS_PER_KNOT

    def speed(tws_kn, twa_deg):
        by = sail**SAIL_POWER * weight**WEIGHT_POWER
        return fast * by * 0.3 * math.sqrt(tws_kn / fast) * math.sin(math.radians(twa_deg)) ** 0.3

    winds = orc_shape.RATED_KN
    vpp = {str(a): [speed(w, a) for w in winds] for a in orc_shape.RATED_DEG}
    vpp |= {"speeds": winds, "beat_angle": [42.0] * 9, "run_angle": [160.0] * 9}
    vpp |= {"beat_vmg": [speed(w, 42.0) * math.cos(math.radians(42.0)) for w in winds]}
    vpp |= {"run_vmg": [-speed(w, 160.0) * math.cos(math.radians(160.0)) for w in winds]}
    sizes = {
        "loa": length,
        "displacement": weight * WEIGHT * WATER_KGPM3 * length**3,
        "main": 0.5 * sail * SAIL * length**2,
        "genoa": 0.5 * sail * SAIL * length**2,
    }
    return {"boat": {"type": f"kind {number}", "sizes": sizes}, "vpp": vpp}


def test_the_law_of_the_certificates_is_found_and_told(tmp_path, monkeypatch, capsys):
    rng = np.random.default_rng(2)
    boats = [certificate(rng, n) for n in range(60)]
    file, out = tmp_path / "orc.json", tmp_path / "shape.csv"
    holed = certificate(rng, 99)
    holed["vpp"]["90"][3] = 0.0
    file.write_text(json.dumps([*boats, boats[0], holed]))  # one twice, one with a hole
    monkeypatch.setattr(sys, "argv", ["orc_shape", str(file), "--out", str(out)])
    orc_shape.main()
    assert capsys.readouterr().out.startswith("60 boats; of those not fitted the error of the logarithm of speed is 0.")
    rows = [line.split(",") for line in out.read_text().splitlines() if line[0] != "#"]
    assert rows[0][3:] == [f"{a:g}" for a in orc_shape.ANGLES_DEG]
    for row in rows[2:]:
        assert float(row[1]) == pytest.approx(SAIL_POWER, abs=0.02)
        assert float(row[2]) == pytest.approx(WEIGHT_POWER, abs=0.02)
        assert float(row[8]) == pytest.approx(0.3 * math.sqrt(float(row[0])), rel=0.02)


def test_the_table_of_the_package_is_of_this_form():
    there = orc_shape.OUT.read_text().splitlines()
    assert "\n".join(there[:4]) + "\n" == orc_shape.HEAD.format(count=1885)
    assert [row.split(",")[0] for row in there[5:]] == [f"{w:g}" for w in orc_shape.WINDS]
