"""The documentation site: Sphinx, MyST (Markdown) and the Furo theme; ``make docs`` builds it into build/docs.

The pages are plain Markdown that reads the same on any forge, so nothing in them is written for Sphinx: the navigation
is read from the lists of docs/index.md, and a page of the API is made of each package that has a face (``__all__``).
"""

from __future__ import annotations

import ast
import inspect
import re
import sys
from enum import Enum
from pathlib import Path

from sphinx.application import Sphinx
from sphinx.errors import SphinxError

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

# ------------------------------------------------------------------------------------------------ what Sphinx reads
project = "Sailboat companion"
copyright = "the authors; MIT licence"  # noqa: A001 - the name that Sphinx reads
extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon"]
root_doc = "docs/index"
include_patterns = [
    "README.md",
    "CHANGELOG.md",
    "CONTRIBUTING.md",
    "docs/*.md",
    *(f"docs/{folder}/*.md" for folder in ("guides", "reference", "lab", "api")),
]
exclude_patterns = [".*", "build", "voyages"]  # not walked

html_theme = "furo"
html_title = project
html_extra_path = ["site"]  # the index.html that leads from the site's top to docs/index.html
html_static_path = ["static"]
html_css_files = ["wide.css"]
html_show_sourcelink = False
html_copy_source = False

myst_heading_anchors = 4  # GitHub's anchors: other pages link to them

autodoc_default_options = {"members": True, "undoc-members": True, "member-order": "bysource"}
autodoc_typehints = "signature"
autodoc_typehints_format = "short"
autodoc_preserve_defaults = True
maximum_signature_line_length = 80
python_use_unqualified_type_names = True
napoleon_numpy_docstring = False
napoleon_use_ivar = True  # a dataclass's attributes are described once, not twice


# --------------------------------------------------------------------------------------------------------- navigation
HEADING = re.compile(r"^## +(.+)$")
ITEM = re.compile(r"^- \[([^\]]+)\]\(([^)#]+)\.md\)")


def navigation(index: str) -> str:
    """Return the tables of contents that the lists of docs/index.md stand for: one for each of its headings."""
    captions: dict[str, list[str]] = {}
    caption = ""
    for line in index.splitlines():
        if heading := HEADING.match(line):
            caption = heading[1]
        elif item := ITEM.match(line):
            captions.setdefault(caption, []).append(f"{item[1].replace('`', '')} <{item[2]}>")
    return "".join(_toctree(pages, caption) for caption, pages in captions.items())


def _toctree(pages: list[str], caption: str = "") -> str:
    options = f":caption: {caption}\n:hidden:\n" if caption else ":maxdepth: 1\n"
    return "\n```{toctree}\n" + options + "\n" + "\n".join(pages) + "\n```\n"


# ---------------------------------------------------------------------------------------------------------------- API
API = ROOT / "docs" / "api"


def faces() -> dict[str, list[str]]:
    """Name the modules that others import from, and what they list: rooms with ``__all__``, and messages."""
    found: dict[str, list[str]] = {"companion.messages": []}
    for file in sorted({*(ROOT / "companion").rglob("__init__.py"), *(ROOT / "companion").glob("*.py")}):
        name = ".".join(file.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__")
        assigned = [node for node in ast.parse(file.read_text()).body if isinstance(node, ast.Assign)]
        for node in assigned:
            if any(isinstance(target, ast.Name) and target.id == "__all__" for target in node.targets):
                found[name] = ast.literal_eval(node.value)
    return found


def page_of(face: str, listed: dict[str, list[str]]) -> str:
    """Return a face's page; what the room around it lists too is described there."""
    above = listed.get(face.rpartition(".")[0], [])
    shared = [name for name in listed[face] if name in above]
    option = f"   :exclude-members: {', '.join(shared)}\n" if shared else ""
    return f"# {face}\n\n```{{eval-rst}}\n.. automodule:: {face}\n{option}```\n"


def write_api(_app: Sphinx) -> None:
    """Write one page a face into docs/api, and leave those alone that say so already."""
    API.mkdir(exist_ok=True)
    listed = faces()
    wanted = {f"{face}.md": page_of(face, listed) for face in listed}
    for file in API.iterdir():
        if file.name not in wanted:
            file.unlink()
    for name, text in wanted.items():
        file = API / name
        if not file.exists() or file.read_text() != text:
            file.write_text(text)


def add_navigation(_app: Sphinx, docname: str, source: list[str]) -> None:
    """Add to a page what only the site needs."""
    if docname == root_doc:
        source[0] += navigation(source[0])
    elif docname == "docs/api":
        source[0] += _toctree([f"api/{face}" for face in faces()])


# --------------------------------------------------------------------------------------------------------- docstrings
LITERAL = re.compile(r"(``.*?``)")
MARKUP = re.compile(r"\||(?<=\w)_(?!\w)")  # |TWA| is a magnitude, WNDVN_ a prefix: no substitution, no link


def plain(_app: Sphinx, what: str, _name: str, _object: object, _options: object, lines: list[str]) -> None:
    """Escape in a docstring what reads as itself and would be markup, and part literals from what they touch."""
    for i, line in enumerate(lines):
        if not line.lstrip().startswith((">>>", "...")):
            parts = LITERAL.split(line)
            parts[::2] = [MARKUP.sub(r"\\\g<0>", part) for part in parts[::2]]
            for k in range(1, len(parts), 2):
                before, after = parts[k - 1][-1:], parts[k + 1][:1]
                parts[k] = "\\ " * (not before.isspace() and before != "") + parts[k] + "\\ " * after.isalnum()
            lines[i] = "".join(parts)
    if what == "property":
        lines.insert(0, "\\ ")  # nothing, so that napoleon does not take the words before a colon for a type


def members(_app: Sphinx, what: str, _name: str, member: object, _skip: bool, _options: object) -> bool | None:
    """Leave out the fields of a class, which its signature has; its methods and what an enumeration lists stay."""
    is_field = not isinstance(member, Enum) and (not hasattr(member, "__get__") or inspect.ismemberdescriptor(member))
    return True if what == "class" and is_field else None


def signature(
    _app: Sphinx, _what: str, _name: str, _object: object, _options: object, arguments: str | None, returns: str | None
) -> tuple[str | None, str | None]:
    """Write a dataclass's made defaults as they can be read."""
    return arguments and arguments.replace("<factory>", "..."), returns


# ------------------------------------------------------------------------------------------------------------ offline
FOREIGN = re.compile(
    r"""<(?:script|img|iframe|source|embed|object)\b[^>]*\b(?:src|data)=["']?(?:https?:)?//"""
    r"""|<link\b(?![^>]*rel=["']?canonical)[^>]*\bhref=["']?(?:https?:)?//"""
    r"""|url\(["']?(?:https?:)?//|@import\s+["'](?:https?:)?//""",
    re.IGNORECASE,
)


def foreign_requests(site: Path) -> list[str]:
    """Name the files of a built site that a browser could not show without asking another host, and what for."""
    files = [file for file in sorted(site.rglob("*")) if file.suffix in {".html", ".css"}]
    return [f"{file.relative_to(site)}: {found[0]}" for file in files for found in FOREIGN.finditer(file.read_text())]


def refuse_foreign_requests(app: Sphinx, error: Exception | None) -> None:
    """End the build when the site is not whole in itself."""
    if error is None and (asked := foreign_requests(Path(app.outdir))):
        raise SphinxError("the site asks other hosts: " + "; ".join(asked))


def setup(app: Sphinx) -> dict[str, bool]:
    """Join the build."""
    app.connect("builder-inited", write_api)
    app.connect("source-read", add_navigation)
    app.connect("autodoc-process-docstring", plain, priority=100)  # before napoleon
    app.connect("autodoc-skip-member", members)
    app.connect("autodoc-process-signature", signature)
    app.connect("build-finished", refuse_foreign_requests)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
