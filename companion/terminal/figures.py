"""Figures in a few characters, with their units; what is not known is a dash."""

from __future__ import annotations

from companion.geo.units import MPS_PER_KNOT

OLD_S = 10.0      # what was heard longer ago looks old


def number(value: float | None, form: str = ".0f", unit: str = "", scale: float = 1.0) -> str:
    """Return a figure with its unit.

    >>> number(12.34, ".1f", " V"), number(None, ".1f", " V"), number(-0.2, "+.0f")
    ('12.3 V', '-', '+0')
    """
    if value is None:
        return "-"
    shown = round(value * scale, 3)
    text = format(shown, form)
    if float(text) == 0.0:
        text = text.replace("-", "+" if "+" in form else "")
    return f"{text}{unit}"


def speed(value_mps: float | None, *, knots: bool) -> str:
    """Return a speed without its unit."""
    return number(value_mps, ".1f", scale=1.0 / MPS_PER_KNOT if knots else 1.0)


def unit(*, knots: bool) -> str:
    """Return the unit of speeds."""
    return "kn" if knots else "m/s"


def direction(angle_deg: float | None) -> str:
    """Return a direction of three digits.

    >>> direction(7.2), direction(359.8)
    ('007°', '000°')
    """
    return "-" if angle_deg is None else f"{round(angle_deg) % 360:03d}°"


def side(angle_deg: float | None) -> str:
    """Return an angle at the bow with its side: S starboard, P port.

    >>> side(-38.2), side(120.0)
    ('38°P', '120°S')
    """
    return "-" if angle_deg is None else f"{abs(angle_deg):.0f}°{'S' if angle_deg >= 0.0 else 'P'}"


def span(seconds: float | None) -> str:
    """Return a time span.

    >>> span(42.0), span(100.0), span(5000.0)
    ('42 s', '1:40', '1 h 23')
    """
    if seconds is None:
        return "-"
    whole = int(max(0.0, seconds))
    if whole < 60:
        return f"{whole} s"
    return f"{whole // 60}:{whole % 60:02d}" if whole < 3600 else f"{whole // 3600} h {whole % 3600 // 60:02d}"


def length(value_m: float | None) -> str:
    """Return a distance.

    >>> length(12.4), length(1852.0)
    ('12 m', '1.9 km')
    """
    return "-" if value_m is None else f"{value_m:.0f} m" if value_m < 1000.0 else f"{value_m / 1000.0:.1f} km"


def share(value: float | None) -> str:
    """Return a probability or a charge in percent."""
    return number(value, ".0f", " %", 100.0)
