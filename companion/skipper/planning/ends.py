"""What ends a voyage early, in words: what is done when a watchdog of the table does."""

from __future__ import annotations

from companion.boat import Boat
from companion.safety import ENDINGS, FAILSAFES, End
from companion.skipper.step.config import SafeEnd, SkipperConfig
from companion.traffic import Policy

POLICY_WORDS = {
    Policy.KEEP_CLEAR: "vessels: kept clear of, whoever must give way",
    Policy.RULES: "vessels: by the rules of the road",
}


def words(config: SkipperConfig, name: str) -> str:
    """Return what is done about a watchdog that ends a voyage, in words."""
    end = config.ends.end(name)
    last = "say so" if ENDINGS[name].sails_on else "loiter near by"
    home = "home, " if config.safe_end is SafeEnd.RETURN else ""
    return {
        End.SAY: "say so", End.STAY: "loiter near by",
        End.REFUGE: f"to the nearest refuge, else {home}{last}", End.HOME: f"home, else to the nearest refuge, {last}",
    }[end]


def announcement(config: SkipperConfig, boat: Boat) -> str:
    """Return all of it in one sentence, and how vessels are met, to be said before setting sail."""
    limits = {"voyage_timeout_s": config.voyage_timeout_s, "max_tws_mps": boat.max_tws_mps,
              "min_tws_mps": boat.min_tws_mps, "": 0.0}
    names = [name for name, ending in ENDINGS.items() if limits[ending.asked_by] is not None]
    said = [f"{name}: {words(config, name)}" for name in names]
    for name in (cause.name for cause in FAILSAFES):
        answer = config.ends.answer(name)
        if answer is not None:
            said.append(f"{name} failsafe: {answer.words}")
    return "; ".join([*said, POLICY_WORDS[config.traffic_policy]])
