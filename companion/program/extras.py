"""What the boat does not need and a wheel does not bring unless it is asked to: its extras, and what each is for."""

from __future__ import annotations

from companion.errors import JobError

NAME = "sailboat-companion"
# By the library that is missed when it is loaded.
EXTRAS = {
    "matplotlib": "plots",
    "mavsdk": "shore",
    "rich": "shore",
    "scipy": "shore",
    "tomlkit": "shore",
    "websockets": "signalk",
    "distributed": "cluster",
    "bokeh": "cluster",
    "pyarrow": "results",
    "filterpy": "papers",
}


def missing(error: ModuleNotFoundError) -> JobError | None:
    """Return what to raise where a library of an extra is not installed, None when another module is missing."""
    library = (error.name or "").partition(".")[0]
    extra = EXTRAS.get(library)
    if extra is None:
        return None
    return JobError(f"{library} is not installed, which this needs; pip install '{NAME}[{extra}]'")
