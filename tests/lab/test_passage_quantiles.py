"""The figures of quantiles that are held against what came."""

import numpy as np
import pytest

from lab.passage_quantiles import lines_of, main, scored, uneven, within


def test_what_lies_evenly_is_even_and_what_does_not_is_told():
    assert uneven(np.linspace(0.005, 0.995, 100)) == pytest.approx(0.005, abs=1e-6)
    assert uneven(np.full(10, 0.9)) == pytest.approx(0.9)
    assert within(np.linspace(0.0, 1.0, 101), 0.1, 0.9) == pytest.approx(0.8, abs=0.01)


def test_a_few_passages_are_sailed_scored_and_drawn(tmp_path, capsys):
    found = scored(1, 3, seed=5)
    assert found.passages == 3
    assert ((found.plain >= 0.0) & (found.plain <= 1.0) & (found.dressed >= 0.0) & (found.dressed <= 1.0)).all()
    again = scored(1, 3, seed=5)
    assert np.array_equal(found.dressed, again.dressed)
    assert lines_of(found)[0].startswith("3 passages of 333 km, 11 members, dressed with ")
    assert main(["--worlds", "1", "--runs", "3", "--plot", str(tmp_path / "p.png")]) == 0
    assert (tmp_path / "p.png").stat().st_size > 5000
    capsys.readouterr()
