"""The editor: a mission drawn in a browser, checked and planned as it is drawn, saved as the file it came from."""

from companion.editor.base import SourceFiles, read_base
from companion.editor.desk import editing
from companion.editor.waters import Water, open_waters

__all__ = ["SourceFiles", "Water", "editing", "open_waters", "read_base"]
