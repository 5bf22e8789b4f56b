"""The watch: raises and clears the watchdogs of the table, and says so."""

from __future__ import annotations

from dataclasses import replace

from companion.frozen import changed
from companion.messages import Mode, Severity
from companion.safety import BY_NAME, TABLE, Response, Watchdog
from companion.skipper.behaviors.drifting import STEERAGE_MPS, is_driven_astern
from companion.skipper.planning.ends import words
from companion.skipper.step.context import StepContext
from companion.skipper.step.state import Raised
from companion.skipper.watch.measures import measure


def watch(ctx: StepContext) -> None:
    """Raise and clear watchdogs; those raised in this very step are ``ctx.fresh``."""
    raised = {r.name: r for r in ctx.state.alarms.raised}
    entering = dict(ctx.state.alarms.entering)
    fresh: list[str] = []
    for dog in TABLE:
        value = measure(ctx, dog.name) if _is_watched(ctx, dog) else None
        above = dog.enter >= dog.exit     # the figure is bad when it is large
        enters = value is not None and (value >= dog.enter if above else value <= dog.enter)
        leaves = value is None or (value <= dog.exit if above else value >= dog.exit)
        if dog.enter == dog.exit:
            leaves = not enters
        if dog.name not in raised:
            if not enters:
                entering.pop(dog.name, None)
                continue
            since = entering.setdefault(dog.name, ctx.t_s)
            if ctx.t_s - since >= _patience_s(ctx, dog):
                raised[dog.name] = Raised(name=dog.name, since_s=ctx.t_s)
                entering.pop(dog.name)
                fresh.append(dog.name)
            continue
        now = raised[dog.name]
        if not leaves:
            raised[dog.name] = replace(now, clear_since_s=None)
            continue
        clear = now.clear_since_s if now.clear_since_s is not None else ctx.t_s
        if ctx.t_s - clear >= dog.exit_s:
            del raised[dog.name]
            ctx.say(Severity.INFO, f"{dog.name} over", f"{dog.name}: over", every_s=0.0)
        else:
            raised[dog.name] = replace(now, clear_since_s=clear)
    order = {dog.name: n for n, dog in enumerate(TABLE)}
    ctx.set(alarms=changed(
        ctx.state.alarms, raised=tuple(sorted(raised.values(), key=lambda r: order[r.name])),
        entering=tuple(sorted(entering.items(), key=lambda e: order[e[0]]))))
    for name in fresh:
        dog = BY_NAME[name]
        value = measure(ctx, name)
        figure = "" if value is None or not dog.unit else f" ({value:.1f} {dog.unit})"
        ctx.say(dog.severity, name, f"{name}{figure}: {_done_about(ctx, dog)}", every_s=0.0)
    ctx.fresh = tuple(fresh)


def _patience_s(ctx: StepContext, dog: Watchdog) -> float:
    """Return how long the entry condition must hold [s]."""
    wind = ctx.wind_now
    is_sure = is_driven_astern(ctx) or (wind is not None and wind[1] < STEERAGE_MPS)
    return dog.unsailed_enter_s if is_sure and dog.unsailed_enter_s is not None else dog.enter_s


def _done_about(ctx: StepContext, dog: Watchdog) -> str:
    return words(ctx.config, dog.name) if dog.response is Response.AS_SET else dog.response.value


def _is_watched(ctx: StepContext, dog: Watchdog) -> bool:
    if dog.at_rest:
        return True
    if ctx.state.voyage.over and not ctx.ahead():
        return dog.loitering and _is_under_way(ctx)
    return _is_under_way(ctx)


def _is_under_way(ctx: StepContext) -> bool:
    status = ctx.autopilot
    own = ctx.state.steering.own_mode
    return (
        ctx.state.voyage.sailing and status is not None and status.is_armed and status.mode in {Mode.AUTO, own}
    )
