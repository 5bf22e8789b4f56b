"""The seeds of a campaign: many, or the first alone with its folder kept."""

import pytest

from sitl import cli


@pytest.mark.parametrize("campaign", ["faults", "mismatch", "shoals", "encounters"])
@pytest.mark.parametrize("more", [["--runs", "1000"], ["--json", "j.json"], ["--out", "o.jsonl"]])
def test_who_asks_for_many_voyages_and_keeps_one_is_told(campaign, more, tmp_path, monkeypatch, capsys):
    """It sailed seed 0 and ended with 0, as if the thousand had passed."""
    monkeypatch.chdir(tmp_path)
    assert cli.main([campaign, "--keep", "kept", *more]) == 2
    assert f"--keep: kept: is for one voyage, of the first seed; leave out {more[0]}" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []
