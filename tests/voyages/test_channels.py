"""Wolsieffer's Figure 7 at sea: the channel that is sailed in a steady wind, under noise, and down wind; ten seeds."""

import pytest

from bench.channels import CHANNEL, WATER, channel
from companion.clock import run_virtual
from sitl.run.embedded import run_embedded
from sitl.scenario.scenario import load_scenario


@pytest.mark.parametrize("seed", [0, *(pytest.param(n, marks=pytest.mark.campaign) for n in range(1, 10))])
@pytest.mark.parametrize("name", CHANNEL)
def test_figure_7_at_sea(name, seed, tmp_path):
    path = WATER / f"{name}.toml"
    verdict = run_virtual(run_embedded(load_scenario(path), path, seed, tmp_path))
    assert verdict.passed, [c.name for c in verdict.checks if not c.passed]
    assert channel(tmp_path) == CHANNEL[name]
