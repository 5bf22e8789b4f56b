"""What may be spent: what is left for afterwards counts where seconds decide, and nowhere else."""

import numpy as np
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


def test_what_comes_after_a_search_is_begun_while_there_is_time_for_it():
    effort = Effort(10.0, None)
    effort.needed_s = 4.0
    assert effort.has_time(5.0)
    assert not effort.has_time(7.0)
    assert Effort(None, 100).has_time(1e9)
    assert Effort(None, None).has_time(1e9)


def test_a_path_is_judged_when_it_is_time_and_not_within_its_own_judgement():
    effort, judged = Effort(1e6, None), []

    def judge(path):
        judged.append(path)
        assert not effort.improved(lambda: path, 100.0)
        return 1e3  # the next one then

    effort.listen(judge)
    effort.first_s = 0.0
    part = effort.part(0.5)
    assert part.improved(lambda: np.zeros((2, 2)), 100.0)
    assert not part.improved(lambda: np.ones((2, 2)), 100.0)
    assert len(judged) == 1
    steps = Effort(None, 100)
    steps.listen(judge)
    assert not steps.improved(lambda: np.zeros((2, 2)), 100.0)


def test_a_part_that_finds_nothing_worth_while_is_given_up_after_a_third_of_it():
    for best_s, ends_after in ((200.1, 51), (199.9, 150)):
        part = Effort(None, 300).part(0.5, hopeless_s=200.0)
        part.improved(lambda: np.zeros((2, 2)), 300.0)
        part.improved(lambda: np.zeros((2, 2)), best_s)
        part.improved(lambda: np.zeros((2, 2)), 250.0)  # worse: the best counts
        spent = 0
        while not part.is_over:
            part.spend(1)
            spent += 1
        assert spent == ends_after
    part = Effort(None, 300).part(0.5, hopeless_s=200.0)
    part.spend(100)
    assert not part.is_over  # nothing was found yet


def test_a_part_does_not_pay_for_the_judgement(monkeypatch):
    now = [0.0]
    monkeypatch.setattr("companion.planner.effort.effort_s", lambda: now[0])
    effort = Effort(10.0, None)
    effort.listen(lambda _: now.__setitem__(0, now[0] + 2.0) or 99.0)
    effort.found()
    part = effort.part(0.3)
    assert part.improved(lambda: np.zeros((2, 2)), 100.0)
    assert part.remaining_s == pytest.approx(3.0)
    effort.needed_s, effort.has_answer = 4.0, True
    now[0] = 4.9
    assert not part.is_over
    now[0] = 7.1  # with what another judgement needs, beyond the whole
    assert effort.is_late
    assert part.is_over
