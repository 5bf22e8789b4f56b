"""What ends a voyage early: the watchdogs that do, what the mission says of each, and the words for it."""

from __future__ import annotations

from companion.boat import Boat
from companion.skipper.step.causes import TABLE
from companion.skipper.step.config import End, SafeEnd, SkipperConfig
from companion.traffic import Policy

# Watchdogs.
BATTERY, LEAK, OUT_OF_TIME = "battery critical", "leaking", "out of time"
DARK, SHORE_LOST = "dark", "shore lost"
STRONG_WIND, LIGHT_WIND = "strong wind", "light wind"
WHY = {
    BATTERY: "the battery is critical", LEAK: "she is leaking", OUT_OF_TIME: "the voyage is out of time",
    DARK: "it is dark", SHORE_LOST: "no ground station is heard",
    STRONG_WIND: "more wind is forecast than she is to be out in",
    LIGHT_WIND: "less wind is forecast than she makes way in",
}
HOW_LONG = {
    BATTERY: "until the battery is charged, or a person takes her",
    LEAK: "until the bilge is dry, or a person takes her",
    DARK: "until it is light", SHORE_LOST: "until a ground station is heard",
    STRONG_WIND: "until less wind is forecast", LIGHT_WIND: "until more wind is forecast",
}

POLICY_WORDS = {
    Policy.KEEP_CLEAR: "vessels: kept clear of, whoever must give way",
    Policy.RULES: "vessels: by the rules of the road",
}


def end_of(config: SkipperConfig, name: str) -> End:
    """Return what the mission's ``[safety]`` says of a watchdog."""
    ends = config.ends
    return {
        BATTERY: ends.battery, LEAK: ends.leak, OUT_OF_TIME: ends.out_of_time, DARK: ends.dark,
        SHORE_LOST: ends.shore_lost, STRONG_WIND: ends.strong_wind, LIGHT_WIND: ends.light_wind,
    }[name]


def words(config: SkipperConfig, name: str) -> str:
    """Return what is done about a watchdog that ends a voyage, in words."""
    end = end_of(config, name)
    last = "say so" if name == BATTERY else "loiter near by"
    home = "home, " if config.safe_end is SafeEnd.RETURN else ""
    return {
        End.SAY: "say so", End.STAY: "loiter near by",
        End.REFUGE: f"to the nearest refuge, else {home}{last}", End.HOME: f"home, else to the nearest refuge, {last}",
    }[end]


def announcement(config: SkipperConfig, boat: Boat) -> str:
    """Return all of it in one sentence, and how vessels are met, to be said before setting sail."""
    names = [BATTERY, LEAK, DARK, SHORE_LOST]
    names += [name for name, limit in ((STRONG_WIND, boat.max_tws_mps), (LIGHT_WIND, boat.min_tws_mps))
              if limit is not None]
    if config.voyage_timeout_s is not None:
        names.insert(2, OUT_OF_TIME)
    said = [f"{name}: {words(config, name)}" for name in names]
    for name in (cause.name for cause in TABLE):
        answer = config.ends.answer(name)
        if answer is not None:
            said.append(f"{name} failsafe: {answer.words}")
    return "; ".join([*said, POLICY_WORDS[config.traffic_policy]])
