"""Buttons for QGroundControl: its ``MavlinkActions`` file, with each verb that needs no typing."""

from __future__ import annotations

import json

from companion.mavlink.reception import OWN_COMPONENT
from companion.orders.fields import VERB_COMMAND, params_of
from companion.orders.order import Wanted
from companion.orders.verbs import TABLE

UNUSED = (0.0, 0.0, 0.0, 0.0)   # param4 to param7


def qgc_actions() -> str:
    """Return the file. QGroundControl ignores a file that has any other key than those it documents."""
    actions = [
        {
            "label": row.button, "description": row.means[:1].upper() + row.means[1:], "mavCmd": VERB_COMMAND,
            "compId": OWN_COMPONENT,
            **{f"param{n}": value for n, value in enumerate((*params_of(Wanted(verb=row.verb)), *UNUSED), 1)},
        }
        for row in TABLE if row.button
    ]
    return json.dumps({"version": 1, "fileType": "MavlinkActions", "actions": actions}, indent=4) + "\n"
