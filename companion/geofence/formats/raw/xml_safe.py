"""XML that strangers wrote: no DTD, no entities, no external references, bounded depth."""

from __future__ import annotations

from typing import Any
from xml.etree.ElementTree import ParseError

import defusedxml
from defusedxml import ElementTree

from companion.errors import InputError
from companion.geofence.formats.raw.text import MAX_DEPTH, MAX_POSITIONS


def parse_xml(data: bytes, source: str) -> Any:
    """Return the root element. Raises InputError with the line for anything malformed or hostile."""
    try:
        root = ElementTree.fromstring(data, forbid_dtd=True, forbid_entities=True, forbid_external=True)
    except defusedxml.DefusedXmlException:
        raise InputError(source, "", "declares a DTD or entities, which are refused", "remove the DOCTYPE") from None
    except ParseError as error:
        line, column = error.position
        what = str(error).split(":", maxsplit=1)[0]
        cut = "no element" in what or "unclosed" in what
        raise InputError(source, f"line {line} column {column + 1}", f"is not XML ({what})",
                         "is the file cut off?" if cut else "") from None
    except (ValueError, LookupError) as error:
        raise InputError(source, "line 1", f"is not XML ({str(error)[:60]})", "save it as UTF-8") from None
    level = [root]
    for _ in range(MAX_DEPTH):
        level = [child for element in level for child in element]
        if not level:
            return root
        if len(level) > MAX_POSITIONS:
            raise InputError(source, "", f"holds more than {MAX_POSITIONS} elements", "split or simplify it")
    raise InputError(source, "", f"elements nest deeper than {MAX_DEPTH}")


def local_name(element: Any) -> str:
    """Return an element's name without its namespace."""
    return str(element.tag).rpartition("}")[2]


def child_text(element: Any, name: str) -> str:
    """Return the text of the first child of that local name ("" without one)."""
    for child in element:
        if local_name(child) == name:
            return (child.text or "").strip()
    return ""
