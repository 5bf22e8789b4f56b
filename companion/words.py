"""Words for numbers: what is counted, singular or plural."""

from __future__ import annotations


def counted(number: int, word: str, plural: str = "") -> str:
    """Return a count with its word.

    >>> counted(1, "leg"), counted(2, "gybe"), counted(0, "way", "ways"), counted(2, "loss", "losses")
    ('1 leg', '2 gybes', '0 ways', '2 losses')
    """
    return f"{number} {word if number == 1 else plural or word + 's'}"
