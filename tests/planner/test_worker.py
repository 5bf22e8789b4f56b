"""The worker process: it plans, is replaced when it hangs or dies, and never holds the event loop."""

from __future__ import annotations

import asyncio
import errno
import itertools
import os
import signal
import subprocess
import sys
import threading

import pytest

from companion.clock import now_s, run, run_virtual
from companion.errors import JobError
from companion.planner import PlanStatus, Problem, child, plan, worker
from companion.planner.fork_server import ForkServer
from companion.planner.worker import InlinePlanner, PlannerWorker
from tests.planner.problems import load, simple


def test_plans_dies_hangs_and_comes_back():
    async def main():
        p = Problem.from_json(simple())
        async with PlannerWorker(grace_s=1.0) as worker:
            first = await worker.plan(p, expansions=3_000, seed=2)
            assert first.has_path
            assert first.waypoints_en.tolist() == plan(p, expansions=3_000, seed=2).waypoints_en.tolist()

            os.kill(worker.pid, signal.SIGKILL)
            await asyncio.sleep(0.2)
            after = await worker.plan(p, expansions=3_000, seed=2)
            assert after.waypoints_en.tolist() == first.waypoints_en.tolist()
            assert worker.restarts == 1

            os.kill(worker.pid, signal.SIGSTOP)
            hung = await worker.plan(p, budget_s=0.1)
            assert hung.status is PlanStatus.UNANSWERED
            assert "in time" in hung.reason
            assert worker.restarts == 2
            assert (await worker.plan(p, expansions=3_000)).has_path

    run(main())


# A fork of a test's own process, which has threads, would not be safe.
NURSED = """
import asyncio, os, signal, sys
from pathlib import Path
from companion.clock import run
from companion.kernels.build import prepare
from companion.planner import PlanStatus, Problem, plan
from companion.planner.fork_server import ForkServer
from companion.planner.worker import PlannerWorker, answer_requests
from tests.planner.problems import simple

def name_of(pid):
    return Path(f"/proc/{pid}/comm").read_text().strip()

prepare(("companion",), say=lambda _: None)
fork_server = ForkServer.begin(answer_requests)
revive = fork_server.revive

def stopped_when_begun():   # on a busy machine it may be ready before the planner is missed
    is_begun = revive()
    if is_begun:
        os.kill(fork_server.pid, signal.SIGSTOP)
    return is_begun

async def killed(worker):
    dead = worker.pid
    os.kill(dead, signal.SIGKILL)   # with nothing asked for
    while worker.pid in {None, dead}:
        await asyncio.sleep(0.05)

async def main():
    p = Problem.from_json(simple())
    wanted = plan(p, expansions=3_000, seed=2).waypoints_en.tolist()
    async with PlannerWorker(grace_s=1.0, fork_server=fork_server) as worker:
        await worker.ready()
        assert (await worker.plan(p, expansions=3_000, seed=2)).waypoints_en.tolist() == wanted
        await killed(worker)
        assert (await worker.plan(p, expansions=3_000, seed=2)).waypoints_en.tolist() == wanted
        os.kill(worker.pid, signal.SIGSTOP)
        assert (await worker.plan(p, budget_s=0.1)).status is PlanStatus.UNANSWERED
        assert (await worker.plan(p, expansions=3_000, seed=2)).waypoints_en.tolist() == wanted
        assert [name_of(worker.pid), name_of(fork_server.pid)] == ["planner", "fork-server"]
        first = fork_server.pid
        fork_server.revive = stopped_when_begun
        os.kill(fork_server.pid, signal.SIGKILL)   # with nobody to fork, it is started
        await killed(worker)
        assert (await worker.plan(p, expansions=3_000, seed=2)).waypoints_en.tolist() == wanted
        assert name_of(worker.pid) == "planner"
        os.kill(fork_server.pid, signal.SIGCONT)
        while fork_server.pid == first or name_of(fork_server.pid) != "fork-server":   # ... and another is begun
            await asyncio.sleep(0.1)
        await killed(worker)
        assert "--fork-server" in Path(f"/proc/{worker.pid}/cmdline").read_text()   # its child again
        assert (await worker.plan(p, expansions=3_000, seed=2)).waypoints_en.tolist() == wanted
        print(worker.restarts)

run(main())
fork_server.close()
assert not fork_server.is_alive
"""


def test_forked_by_a_fork_server_it_plans_the_same_dies_hangs_and_comes_back():
    """A fork server that had died stayed dead, and every planner after it loaded everything for itself."""
    done = subprocess.run([sys.executable, "-c", NURSED], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout) == (0, "4\n"), done.stderr
    assert "it is started as a program of its own" in done.stderr
    assert "the planners' fork server died; it is begun anew" in done.stderr


def test_a_child_that_dies_with_nothing_asked_for_is_there_again_when_something_is(monkeypatch):
    """It was started by the next request, which waited for its kernels: 25 s on a tenth of a core."""

    async def main():
        async with PlannerWorker() as planner:
            await planner.ready()
            dead = planner.pid
            os.kill(dead, signal.SIGKILL)
            until_s = now_s() + 60.0
            while planner.pid in {None, dead} or not planner._is_warm:
                assert now_s() < until_s
                await asyncio.sleep(0.05)
            assert planner.restarts == 1
            monkeypatch.setattr(planner, "_warm", nothing)  # there is nothing to wait for
            assert (await planner.plan(Problem.from_json(simple()), expansions=1_000)).has_path
            assert planner.restarts == 1

    async def nothing():
        pass

    run(main())


def test_a_process_with_threads_is_not_forked():
    waiting = threading.Event()
    other = threading.Thread(target=waiting.wait)
    other.start()
    try:
        assert ForkServer.begin(worker.answer_requests) is None
    finally:
        waiting.set()
        other.join()


def test_a_worker_that_cannot_start_is_an_outcome():
    async def main():
        async with PlannerWorker(command=[sys.executable, "-c", "raise SystemExit(3)"]) as worker:
            answer = await worker.plan(Problem.from_json(simple()), budget_s=0.2)
            assert answer.status is PlanStatus.UNANSWERED
            assert "died" in answer.reason

    run(main())


def test_a_child_that_cannot_be_started_again_is_an_outcome_and_is_tried_again(monkeypatch):
    """ENOMEM, EAGAIN, EMFILE: what the system lacks now it may have in a minute, and the voyage goes on."""

    async def refused(command):
        raise OSError(errno.ENOMEM, "Cannot allocate memory")

    async def main():
        p = Problem.from_json(simple())
        async with PlannerWorker(grace_s=1.0) as planner:
            assert (await planner.plan(p, expansions=3_000)).has_path
            begin = child.Started.begin
            monkeypatch.setattr(worker, "_REST_S", 0.1)
            monkeypatch.setattr(child.Started, "begin", refused)
            os.kill(planner.pid, signal.SIGKILL)
            await asyncio.sleep(0.5)  # the watch has seen it
            assert not planner.is_alive
            answer = await planner.plan(p, expansions=3_000)
            assert answer.status is PlanStatus.UNANSWERED
            assert "cannot be started" in answer.reason
            assert "Cannot allocate memory" in answer.reason
            monkeypatch.setattr(child.Started, "begin", begin)
            async with asyncio.timeout(30.0):
                while not planner.is_alive:  # noqa: ASYNC110 - the watch starts it, nobody asking
                    await asyncio.sleep(0.1)
            assert (await planner.plan(p, expansions=3_000)).has_path

    run(main())


def test_a_child_that_hangs_and_cannot_be_started_again_is_an_outcome(monkeypatch):
    async def refused(command):
        raise OSError(errno.EMFILE, "Too many open files")

    async def main():
        p = Problem.from_json(simple())
        async with PlannerWorker(grace_s=0.5) as planner:
            assert (await planner.plan(p, expansions=3_000)).has_path
            monkeypatch.setattr(child.Started, "begin", refused)
            os.kill(planner.pid, signal.SIGSTOP)
            assert (await planner.plan(p, budget_s=0.1)).status is PlanStatus.UNANSWERED

    run(main())


def test_a_fork_server_that_cannot_be_begun_anew_does_not_end_the_watch(monkeypatch):
    class Refused:
        def revive(self):
            raise OSError(errno.EAGAIN, "Resource temporarily unavailable")

        def planner(self):
            raise JobError("no planner could be forked")

    async def main():
        p = Problem.from_json(simple())
        async with PlannerWorker(grace_s=1.0, fork_server=Refused()) as planner:
            assert (await planner.plan(p, expansions=3_000)).has_path
            os.kill(planner.pid, signal.SIGKILL)
            async with asyncio.timeout(30.0):
                while planner.restarts == 0 or not planner.is_alive:  # noqa: ASYNC110 - it tells nobody
                    await asyncio.sleep(0.1)

    run(main())


# A machine so slow that compiling takes twice as long as any silence is borne.
SLOW = """
import time
from companion.planner import worker

def prepare(packages, *, say):
    for n in range(20):
        say(f"{n} of 20")
        time.sleep(0.3)

worker.prepare, worker._BEAT_S = prepare, 0.1
worker.serve()
"""


def test_a_child_that_compiles_is_alive_however_long_it_takes(monkeypatch):
    """It was given 180 s, and taken for hung: the first start on a slow or busy machine failed."""
    monkeypatch.setattr(worker, "_SILENCE_S", 3.0)  # a busy machine has paused a child for one

    async def main():
        said = []
        async with PlannerWorker(command=[sys.executable, "-c", SLOW]) as planner:
            await planner.ready(said.append)
            assert planner.restarts == 0
            assert {"3 of 20", "19 of 20"} <= set(said)
            os.kill(planner.pid, signal.SIGKILL)  # under way: a request waits for the new one's kernels
            await asyncio.sleep(0.2)
            assert (await planner.plan(Problem.from_json(simple()), expansions=3_000)).has_path
            assert planner.restarts == 1

    run(main())


@pytest.mark.parametrize(("deaths", "is_ready"), [(2, True), (99, False)])
def test_a_child_that_is_killed_while_it_gets_ready_is_started_again(tmp_path, deaths, is_ready):
    """A kill in the first seconds was the end of the voyage: "the planner's process did not start", exit 1."""
    dies = (
        "import pathlib, sys; lives = pathlib.Path(sys.argv[1]); n = len(list(lives.iterdir())); "
        "(lives / str(n)).touch(); n < int(sys.argv[2]) and sys.exit(9); "
        "from companion.planner.worker import serve; serve()"
    )

    async def main():
        async with PlannerWorker(command=[sys.executable, "-c", dies, str(tmp_path), str(deaths)]) as planner:
            if is_ready:
                await planner.ready()
                assert planner.restarts == deaths
                return
            with pytest.raises(EOFError):
                await planner.ready()

    run(main())


def test_a_child_that_falls_silent_while_it_compiles_is_replaced(monkeypatch):
    monkeypatch.setattr(worker, "_SILENCE_S", 1.0)

    async def main():
        async with PlannerWorker(command=[sys.executable, "-c", SLOW]) as planner:

            def stop_it(word):
                os.kill(planner.pid, signal.SIGSTOP)

            with pytest.raises(TimeoutError):
                await planner.ready(stop_it)
            assert (await planner.plan(Problem.from_json(simple()), expansions=3_000)).status is PlanStatus.UNANSWERED
            await planner.ready()
            assert planner.restarts == 1

    run(main())


# A child that hands out what it has found, and then dies or stands still.
ENDS = """
import os, sys, time
from companion.planner import plan, worker
from companion.planner.solve import warm

warm()

def planned(problem, *, on_better, **request):
    on_better(plan(problem, expansions=1_000))
    {end}

worker.plan = planned
worker.answer_requests(sys.stdin.buffer, sys.stdout.buffer)
"""


@pytest.mark.parametrize(
    ("end", "said", "restarts"),
    [("os._exit(9)", "died", 1), ("time.sleep(99.0)", "did not answer in time", 1), ("raise MemoryError", "failed", 0)],
)
def test_a_child_that_is_killed_or_too_slow_leaves_the_best_that_it_had_found(end, said, restarts):
    """It left nothing, however good its path was: on a slow computer the boat never set sail."""

    async def main():
        async with PlannerWorker(command=[sys.executable, "-c", ENDS.format(end=end)]) as planner:
            await planner.ready()
            answer = await planner.plan(Problem.from_json(simple()), budget_s=0.2)
            assert answer.has_path
            assert said in answer.reason
            assert planner.restarts == restarts

    run(main())


def test_a_plan_that_is_overtaken_ends_at_once_and_the_child_goes_on():
    """The next waited for all of its time; with an end of the child it would have waited for its kernels."""

    async def main():
        problem, long_s = load("channel-beat"), 60.0
        async with PlannerWorker() as planner:
            await planner.ready()
            wanted = (await planner.plan(problem, expansions=3_000, seed=2)).waypoints_en.tolist()
            for times in range(1, 4):
                old = asyncio.create_task(planner.plan(problem, expansions=10**9, budget_s=long_s))
                behind = asyncio.create_task(planner.plan(problem, expansions=10**9, budget_s=long_s))
                await asyncio.sleep(0.1 * times)
                began_s = now_s()
                planner.overtake()
                planner.overtake()
                new = await planner.plan(problem, expansions=3_000, seed=2)
                assert now_s() - began_s < 0.25 * long_s  # of a machine that has other things to do
                assert new.waypoints_en.tolist() == wanted
                assert "another plan is wanted" in (await behind).reason
                await old
            assert planner.restarts == 0

    run(main())


# A child that gets a tenth of the processor: what takes a second and a half of its time is done in as much.
STARVED = """
import sys, time
from companion.planner import plan, worker
from companion.planner.solve import warm

warm()

def planned(problem, *, on_better, **request):
    for _ in range({slices}):
        time.sleep(0.1)
        until_s = time.process_time() + 0.015
        while time.process_time() < until_s:
            pass
    return plan(problem, expansions=1_000)

worker.plan = planned
worker.answer_requests(sys.stdin.buffer, sys.stdout.buffer)
"""


def test_a_child_that_shows_life_is_not_killed_for_slowness():
    """It was killed after its budget and three seconds, on a computer that had given it a third of one."""

    async def main():
        async with PlannerWorker(grace_s=0.5, command=[sys.executable, "-c", STARVED.format(slices=15)]) as planner:
            await planner.ready()
            answer = await planner.plan(Problem.from_json(simple()), budget_s=0.2)
            assert answer.has_path
            assert planner.restarts == 0
            assert 0.0 < answer.speed < 5.0

    run(main())


# A child that sleeps for four fifths of the time in which it gets ready.
SLEEPY = """
import sys, time
from companion.planner import worker
from companion.planner.solve import warm

warm()
measured = worker.speed

def speed():
    cpu_s = time.process_time()
    found = measured()
    time.sleep(4.0 * (time.process_time() - cpu_s))
    return found

worker.speed = speed
worker.answer_requests(sys.stdin.buffer, sys.stdout.buffer)
"""


def test_a_child_says_what_it_gets_of_the_processor_when_it_is_ready():
    """Before the first answer nobody knew, and the first plan is the one that all others begin with."""

    async def main():
        async with PlannerWorker(command=[sys.executable, "-c", SLEEPY]) as planner:
            assert planner.share == 1.0
            await planner.ready()
            assert 0.01 < planner.share < 0.25

    run(main())


def test_a_child_that_has_had_its_budget_and_does_not_end_is_hung():
    async def main():
        async with PlannerWorker(grace_s=0.5, command=[sys.executable, "-c", STARVED.format(slices=9999)]) as planner:
            await planner.ready()
            answer = await planner.plan(Problem.from_json(simple()), budget_s=0.05)
            assert answer.status is PlanStatus.UNANSWERED
            assert planner.restarts == 1

    run(main())


def test_an_answer_that_waits_is_taken_however_late_it_is_looked_for(monkeypatch):
    """A process that is starved itself came back after its deadline, and killed a child that had answered."""

    async def main():
        async with PlannerWorker() as planner:
            await planner.ready()
            late = itertools.chain([0.0, 0.0, 0.0], itertools.repeat(1e6))
            monkeypatch.setattr(worker, "_PULSE_S", 30.0)
            monkeypatch.setattr(worker, "effort_s", lambda: next(late))
            assert (await planner.plan(Problem.from_json(simple()), expansions=1_000)).has_path
            assert planner.restarts == 0

    run(main())


def test_what_a_child_hands_out_on_the_way_is_not_taken_for_its_answer():
    async def main():
        async with PlannerWorker() as planner:
            found = await planner.plan(load("four-beat-60"), budget_s=0.3, seed=1)
            assert found.has_path
            assert "search" not in found.unproven
            assert (await planner.plan(Problem.from_json(simple()), expansions=1_000)).cost_s < 120.0

    run(main())


def test_the_loop_is_not_held():
    async def main():
        worst = 0.0

        async def pulse():
            nonlocal worst
            while True:
                before = now_s()
                await asyncio.sleep(0.01)
                worst = max(worst, now_s() - before - 0.01)

        p = load("coast-5000-beat")
        async with PlannerWorker() as worker:
            await worker.plan(Problem.from_json(simple()), expansions=1_000)
            task = asyncio.create_task(pulse())
            answer = await worker.plan(p, budget_s=1.0)
            task.cancel()
        assert answer.has_path
        return worst

    # Best of three: what else runs on the machine also delays the loop.
    assert any(run(main()) < 0.05 for _ in range(3))


def test_a_cancelled_request_does_not_answer_the_next():
    async def main():
        async with PlannerWorker() as worker:
            await worker.plan(Problem.from_json(simple()), expansions=1_000)
            with pytest.raises(TimeoutError):
                async with asyncio.timeout(0.2):
                    await worker.plan(load("islands-200-beat"), budget_s=5.0)
            answer = await worker.plan(Problem.from_json(simple()), expansions=1_000)
            assert answer.cost_s < 120.0

    run(main())


def test_inline_takes_its_time_on_the_virtual_clock_and_repeats():
    async def main():
        async with InlinePlanner(virtual_s=1.5) as planner:
            began = now_s()
            answer = await planner.plan(load("four-beat-60"), budget_s=0.001, expansions=20_000, seed=4)
            return answer.waypoints_en.tolist(), now_s() - began

    first, again = run_virtual(main()), run_virtual(main())
    assert first == again
    assert first[1] == pytest.approx(1.5)
    assert len(first[0]) > 1
