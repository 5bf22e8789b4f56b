"""Names in docstrings: what stands between double backticks is in the tree, or a reader looks for what is gone."""

import ast
import io
import re
import tokenize
from pathlib import Path

ROOT = Path(__file__).parents[2]
TREES = ("companion", "sitl", "lab", "bench", "sailbench")
NAMED = re.compile(r"``([A-Za-z_][\w.]*)``")
WORD = re.compile(r"[A-Za-z_]\w*")
OTHERS = {".js", ".ts", ".toml", ".html", ".css"}
FOREIGN = {"ps", "failsafe_trigger", "getrandbits", "sog_kn"}  # a program, ArduRover's, Python's, a user's column
BEGINNING = {"S_", "P_"}  # of the names of indices


def prose(tree):
    """Yield the node of each docstring, and of each string that stands behind a field."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant) and isinstance(node.value.value, str):
            yield node.value


def test_names_in_docstrings_exist():
    named, known = {}, set()
    for tree in TREES:
        for path in sorted((ROOT / tree).rglob("*")):
            known |= set(WORD.findall(path.stem))
            if path.suffix in OTHERS:
                known |= set(WORD.findall(path.read_text(encoding="utf-8")))
            elif path.suffix == ".py":
                text = path.read_text(encoding="utf-8")
                said = list(prose(ast.parse(text)))
                begins = {(node.lineno, node.col_offset) for node in said}
                for token in tokenize.generate_tokens(io.StringIO(text).readline):
                    is_code = token.type in {tokenize.NAME, tokenize.STRING} and token.start not in begins
                    known |= set(WORD.findall(token.string)) if is_code else set()
                    if token.type == tokenize.COMMENT:
                        for name in NAMED.findall(token.string):
                            named.setdefault(name, f"{path.relative_to(ROOT)}:{token.start[0]}")
                for node in said:
                    for name in NAMED.findall(node.value):
                        named.setdefault(name, f"{path.relative_to(ROOT)}:{node.lineno}")
    known |= FOREIGN | BEGINNING
    gone = {place: name for name, place in named.items() if not set(name.rstrip(".").split(".")) <= known}
    assert gone == {}
