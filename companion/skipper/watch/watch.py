"""The watch: raises and clears the watchdogs of the table, and says so."""

from __future__ import annotations

from dataclasses import replace

from companion.frozen import changed
from companion.messages import Mode
from companion.skipper.deeds.adrift import STEERAGE_MPS
from companion.skipper.planning.ends import words
from companion.skipper.step.actions import Severity
from companion.skipper.step.state import Raised
from companion.skipper.step.turn import Turn
from companion.skipper.watch.measures import measure
from companion.skipper.watch.watchdogs import BY_NAME, TABLE, Response, Watchdog


def watch(turn: Turn) -> None:
    """Raise and clear watchdogs; those raised in this very step are ``turn.fresh``."""
    raised = {r.name: r for r in turn.state.alarms.raised}
    entering = dict(turn.state.alarms.entering)
    fresh: list[str] = []
    for dog in TABLE:
        value = measure(turn, dog.name) if _is_watched(turn, dog) else None
        above = dog.enter >= dog.exit     # the figure is bad when it is large
        enters = value is not None and (value >= dog.enter if above else value <= dog.enter)
        leaves = value is None or (value <= dog.exit if above else value >= dog.exit)
        if dog.enter == dog.exit:
            leaves = not enters
        if dog.name not in raised:
            if not enters:
                entering.pop(dog.name, None)
                continue
            since = entering.setdefault(dog.name, turn.t_s)
            if turn.t_s - since >= _patience_s(turn, dog):
                raised[dog.name] = Raised(name=dog.name, since_s=turn.t_s)
                entering.pop(dog.name)
                fresh.append(dog.name)
            continue
        now = raised[dog.name]
        if not leaves:
            raised[dog.name] = replace(now, clear_since_s=None)
            continue
        clear = now.clear_since_s if now.clear_since_s is not None else turn.t_s
        if turn.t_s - clear >= dog.exit_s:
            del raised[dog.name]
            turn.say(Severity.INFO, f"{dog.name} over", f"{dog.name}: over", every_s=0.0)
        else:
            raised[dog.name] = replace(now, clear_since_s=clear)
    order = {dog.name: n for n, dog in enumerate(TABLE)}
    turn.set(alarms=changed(
        turn.state.alarms, raised=tuple(sorted(raised.values(), key=lambda r: order[r.name])),
        entering=tuple(sorted(entering.items(), key=lambda e: order[e[0]]))))
    for name in fresh:
        dog = BY_NAME[name]
        value = measure(turn, name)
        figure = "" if value is None or not dog.unit else f" ({value:.1f} {dog.unit})"
        turn.say(dog.severity, name, f"{name}{figure}: {_done_about(turn, dog)}", every_s=0.0)
    turn.fresh = tuple(fresh)


def _patience_s(turn: Turn, dog: Watchdog) -> float:
    """Return how long the entry condition must hold [s]."""
    wind = turn.wind_now
    is_calm = wind is not None and wind[1] < STEERAGE_MPS
    return dog.calm_enter_s if is_calm and dog.calm_enter_s is not None else dog.enter_s


def _done_about(turn: Turn, dog: Watchdog) -> str:
    return words(turn.config, dog.name) if dog.response is Response.AS_SET else dog.response.value


def _is_watched(turn: Turn, dog: Watchdog) -> bool:
    if dog.at_rest:
        return True
    if turn.state.voyage.over and not turn.ahead():
        return dog.loitering and _is_under_way(turn)
    return _is_under_way(turn)


def _is_under_way(turn: Turn) -> bool:
    status = turn.autopilot
    own = turn.state.steering.own_mode
    return (
        turn.state.voyage.sailing and status is not None and status.is_armed and status.mode in {Mode.AUTO, own}
    )
