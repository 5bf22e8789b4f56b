"""Time: virtual time is arithmetic, scaled time is scaled."""

import asyncio
import signal
import time

import pytest

from companion.clock import RealTimeLoop, now_s, run, run_virtual


def test_virtual_time_passes_without_waiting():
    async def main():
        began = now_s()
        await asyncio.sleep(86400.0)
        return now_s() - began

    wall = time.monotonic()
    assert run_virtual(main()) == pytest.approx(86400.0)
    assert time.monotonic() - wall < 5.0


def test_virtual_time_keeps_order_and_deadlines():
    async def main():
        seen = []

        async def note(after_s, name):
            await asyncio.sleep(after_s)
            seen.append((now_s(), name))

        await asyncio.gather(note(3.0, "c"), note(1.0, "a"), note(2.0, "b"))
        with pytest.raises(TimeoutError):
            async with asyncio.timeout(5.0):
                await asyncio.Event().wait()
        return seen, now_s()

    seen, end = run_virtual(main())
    assert [name for _, name in seen] == ["a", "b", "c"]
    assert end == pytest.approx(8.0)


def test_virtual_time_that_stands_still_is_an_error():
    async def main():
        await asyncio.Event().wait()

    with pytest.raises(RuntimeError, match="stands still"):
        run_virtual(main())


def test_scaled_time_runs_faster():
    async def main():
        began, wall = now_s(), time.monotonic()
        await asyncio.sleep(5.0)
        return now_s() - began, time.monotonic() - wall

    loop_s, wall_s = run(main(), speedup=50.0)
    assert loop_s >= 5.0
    assert wall_s < 4.0


def test_a_speedup_must_be_positive():
    async def main():
        pass

    with pytest.raises(ValueError, match="positive"):
        run(main(), speedup=0.0)


def test_a_signal_while_the_loop_closes_leaves_no_traceback(capfd, monkeypatch):
    """The pipe that signals wake it by is closed before their handlers are taken away."""
    loop = RealTimeLoop()
    loop.add_signal_handler(signal.SIGUSR1, lambda: None)
    close_pipe = loop._close_self_pipe

    def close_and_be_told_again():
        close_pipe()
        signal.raise_signal(signal.SIGUSR1)

    monkeypatch.setattr(loop, "_close_self_pipe", close_and_be_told_again)
    loop.close()
    assert "wakeup fd" not in capfd.readouterr().err
