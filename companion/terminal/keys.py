"""Keys to orders: what a key asks for, and the question before an order that moves the boat or gives it up. Pure."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace

from companion.errors import InputError
from companion.orders import Verb, Wanted, permitted, phrase

YES = frozenset("yY")
BACKSPACE, ENTER, ESCAPE, CTRL_U = frozenset("\x08\x7f"), frozenset("\r\n"), "\x1b", "\x15"
MOST = 60  # characters of a place or a name


@dataclass(frozen=True, slots=True, kw_only=True)
class Key:
    """A key: the order that it gives, what it is called; ``asks`` before it is given, ``takes`` words behind it."""

    key: str
    verb: Verb
    label: str
    asks: str = ""
    takes: str = ""


KEYS = (
    Key(key="w", verb=Verb.WHY, label="why"),
    Key(key="h", verb=Verb.HOLD, label="hold"),
    Key(key="g", verb=Verb.GO_ON, label="go on", asks="she sails on"),
    Key(key="p", verb=Verb.REPLAN, label="plan"),
    Key(key="r", verb=Verb.REFUGE, label="refuge", asks="she leaves her way", takes="which (empty: the nearest)"),
    Key(key="m", verb=Verb.HOME, label="home", asks="she leaves her way"),
    Key(key="o", verb=Verb.GOAL, label="goal", asks="she leaves her way", takes="LAT LON"),
    Key(key="n", verb=Verb.SKIP_GOAL, label="next goal", asks="the goal that is next is given up"),
    Key(key="s", verb=Verb.STOP, label="stop", asks="nothing more is asked of her: she sails on as she is"),
    Key(key="a", verb=Verb.ADOPT, label="adopt", asks="this voyage ends, what was drawn is sailed"),
    Key(key="x", verb=Verb.REPLACE, label="replace", asks="the mission on board is overwritten"),
    Key(key="f", verb=Verb.FREEZE, label="freeze"),
    Key(key="l", verb=Verb.LEARN, label="learn"),
    Key(
        key="d",
        verb=Verb.FORGET_SHOAL,
        label="forget shoal",
        asks="plans lead over it again",
        takes="which (empty: the nearest)",
    ),
)
BY_KEY = {key.key: key for key in KEYS}


@dataclass(frozen=True, slots=True, kw_only=True)
class KeyCommands:
    """Where the typing stands: a key that waits for words (``typed``), a wanted order that waits for a yes.

    ``order`` and ``is_over`` are what the last key asked of the program: to give an order, to end.
    """

    typing: Key | None = None
    typed: str = ""
    asking: tuple[Key, Wanted] | None = None
    said: str = ""
    order: Wanted | None = None
    is_over: bool = False
    has_help: bool = False
    knots: bool = True

    def press(self, key: str, orders: Collection[str] | None) -> KeyCommands:
        """Return the helm behind a key; ``orders`` are the verbs that are permitted, None: not known here."""
        helm = replace(self, order=None)
        if key == "\x03":
            return replace(helm, is_over=True)
        if helm.asking is not None:
            wanted = helm.asking[1]
            if key in YES:
                return replace(helm, asking=None, order=wanted, said="")
            return replace(helm, asking=None, said=f"{wanted.words}: not given")
        if helm.typing is not None:
            return _type(helm, helm.typing, key)
        if key in {"q", "Q"}:
            return replace(helm, is_over=True)
        if key == "u":
            return replace(helm, knots=not helm.knots)
        if key == "?":
            return replace(helm, has_help=not helm.has_help)
        chosen = BY_KEY.get(key.lower())
        if chosen is None:
            return replace(helm, has_help=False)
        if orders is not None and not permitted(chosen.verb, orders):
            return replace(helm, said=f"{chosen.label}: the mission does not permit it here")
        if chosen.takes:
            return replace(helm, typing=chosen, typed="", said="")
        return _wanted(helm, chosen, [])

    @property
    def prompt(self) -> str:
        """What is asked of who types; empty: nothing."""
        if self.asking is not None:
            key, wanted = self.asking
            return f"{wanted.words}: {key.asks}. y: yes, any other key: no"
        if self.typing is not None:
            return f"{self.typing.label}, {self.typing.takes}: {self.typed}_"
        return ""


def _type(helm: KeyCommands, chosen: Key, key: str) -> KeyCommands:
    if key == ESCAPE:
        return replace(helm, typing=None, typed="", said=f"{chosen.label}: not given")
    if key in ENTER:
        return _wanted(replace(helm, typing=None, typed=""), chosen, helm.typed.split())
    if key in BACKSPACE:
        return replace(helm, typed=helm.typed[:-1])
    if key == CTRL_U:
        return replace(helm, typed="")
    return replace(helm, typed=(helm.typed + key)[:MOST]) if key.isprintable() else helm


def _wanted(helm: KeyCommands, chosen: Key, words: list[str]) -> KeyCommands:
    try:
        wanted = phrase([chosen.verb, *words])
    except InputError as error:
        return replace(helm, said=f"{error}")
    return replace(helm, asking=(chosen, wanted)) if chosen.asks else replace(helm, order=wanted, said="")


def words_of(wanted: Wanted) -> str:
    """Return an order in the words that ``phrase`` reads.

    >>> words_of(phrase(["refuge", "2"])), words_of(phrase(["goal", "50.1234567", "-1.5"]))
    ('refuge 2', 'goal 50.1234567 -1.5')
    """
    what = [str(wanted.number)] if wanted.number else [wanted.name] if wanted.name else []
    where = [] if wanted.place is None else [repr(wanted.place.lat_deg), repr(wanted.place.lon_deg)]
    return " ".join([str(wanted.verb), *what, *where])


def shown(orders: Collection[str] | None) -> tuple[Key, ...]:
    """Return the keys that are of use."""
    return KEYS if orders is None else tuple(key for key in KEYS if permitted(key.verb, orders))
