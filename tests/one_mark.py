"""Missions of one mark that tests sail: from one place, past a rock or through open water."""


def one_mark(name, mark, heading_deg, *, rock=True, tables=""):
    """Return the TOML of a mission to ``mark`` (lat, lon) that may arm and set AUTO; ``tables`` go on in [operator]."""
    obstacles = 'obstacles = ["rock.wkt"]\n' if rock else ""
    return f"""
name = "{name}"
[start]
lat = 50.8170000
lon = -1.3100000
heading_deg = {heading_deg}
[[goal]]
name = "mark"
lat = {mark[0]}
lon = {mark[1]}
radius_m = 10.0
[area]
{obstacles}margin_m = 10.0
[operator]
arm = true
set_auto = true
{tables}"""
