"""What may be spent: what is left for afterwards counts where seconds decide, and nowhere else."""

import pytest

from companion.planner.effort import Effort


def test_seconds_for_afterwards_are_not_the_searchs():
    effort = Effort(1e6, None)
    effort.after_s = 4e5
    assert effort.remaining_s == pytest.approx(6e5, abs=1e3)
    assert not effort.is_over
    effort.after_s = 1e6
    assert effort.is_over
    assert effort.fraction == 1.0


def test_where_expansions_decide_no_second_counts():
    effort = Effort(None, 100)
    effort.after_s = 1e6
    effort.spend(40)
    assert effort.fraction == 0.4
    assert not effort.is_over
