"""The editor: a mission drawn in a browser, checked and planned as it is drawn, saved as the file it came from."""

from companion.editor.base import Base, read_base
from companion.editor.desk import Place, editing

__all__ = ["Base", "Place", "editing", "read_base"]
