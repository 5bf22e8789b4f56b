"""A track judged: its terms and what was told of it by name, in one call."""

from dataclasses import fields

from sitl.scenario import Terms, Told, judge


def judged(*, truth, began_s=0.0, keel_m=None, **how):
    terms = {f.name: how.pop(f.name) for f in fields(Terms) if f.name in how}
    return judge(Terms(**terms), truth, Told(**how), began_s=began_s, keel_m=keel_m)
