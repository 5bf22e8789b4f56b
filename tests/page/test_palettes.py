"""The palettes of page and editor: words can be read on what lies under them, and the night is red alone.

What the page writes in HTML a browser's own look at contrast covers; what is written on charts and dials, it does not.
"""

import re
from pathlib import Path

import pytest

from tests.page.test_javascript import EDITOR, WEB

WORDS = 4.5  # of WCAG 2, for words
SIGNS = 3.0  # for lines and signs that tell something
PALETTES = ("day", "dusk", "night")
# words and signs of the page with what lies under them, or in the halo about them
PAGE = [
    (WORDS, "ink soft", "bg panel water"),
    (WORDS, "ink", "land"),
    (WORDS, "port starboard true good poor bad plan1 plan2 accent", "panel"),
    (WORDS, "true good", "water"),
    (WORDS, "panel", "accent bad true apparent"),
    (SIGNS, "port starboard plan0 plan1 plan2 mark ahead shore unknown", "water"),
]
# of the chart under the editor's drawing
CHART = [
    (WORDS, "word soft", "shoal shallow deep"),
    (WORDS, "word", "land built dry unknown"),
    (SIGNS, "mark", "land dry shoal shallow deep"),
    (SIGNS, "shore danger contour", "shallow deep"),
]


def palettes(path, prefix=""):
    """Return the colours of each palette of a style sheet, by their names behind the prefix."""
    found = {}
    for name, body in re.findall(r':root(?:\[data-palette="(\w+)"\])? \{(.*?)\}', Path(path).read_text(), re.DOTALL):
        colours = dict(re.findall(rf"--{prefix}(\w+): (#[0-9a-f]+)", body))
        if colours:
            found[name or "day"] = colours
    return found


def channels(colour):
    digits = colour[1:7] if len(colour) > 5 else "".join(2 * digit for digit in colour[1:4])
    return [int(digits[n : n + 2], 16) / 255.0 for n in (0, 2, 4)]


def contrast(one, other):
    """Return the contrast ratio of WCAG 2.2 of two colours."""

    def luminance(colour):
        linear = [c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in channels(colour)]
        return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]

    low, high = sorted((luminance(one), luminance(other)))
    return (high + 0.05) / (low + 0.05)


@pytest.mark.parametrize("palette", PALETTES)
@pytest.mark.parametrize(
    ("path", "prefix", "held"), [(WEB / "style.css", "", PAGE), (EDITOR / "editor.css", "chart-", CHART)]
)
def test_words_and_signs_are_told_from_what_they_lie_on(path, prefix, held, palette):
    colours = palettes(path, prefix)[palette]
    low = {
        f"{word} on {under}": round(contrast(colours[word], colours[under]), 2)
        for least, words, unders in held
        for word in words.split()
        for under in unders.split()
        if contrast(colours[word], colours[under]) < least
    }
    assert low == {}


@pytest.mark.parametrize(("path", "prefix"), [(WEB / "style.css", ""), (EDITOR / "editor.css", "chart-")])
def test_the_night_is_red_and_its_ground_is_dark(path, prefix):
    night = palettes(path, prefix)["night"]
    assert len(night) > 12
    for name, colour in night.items():
        red, green, blue = channels(colour)
        assert max(green, blue) <= 0.65 * red, name
    grounds = "bg panel water land drying" if not prefix else "land built dry shoal shallow deep unknown"
    assert all(contrast(night[name], "#000000") < 1.6 for name in grounds.split())
