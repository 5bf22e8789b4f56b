"""The house: every room says what it owns, its face is where its names come from, a sub-room is entered by its face."""

import ast
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
CODE = sorted(p for top in ("companion", "sitl", "lab", "sailbench") for p in (ROOT / top).rglob("*.py"))
ROOMS = sorted({p.parent for p in CODE})


def name_of(path):
    return ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__")


def imported(path):
    return [
        n.module
        for n in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(n, ast.ImportFrom) and n.module is not None
    ]


@pytest.mark.parametrize("room", ROOMS, ids=name_of)
def test_a_room_says_what_it_owns(room):
    first = ast.get_docstring(ast.parse((room / "__init__.py").read_text(encoding="utf-8")))
    assert first
    assert first.splitlines()[0].endswith(".")


def test_a_sub_room_is_entered_by_its_face():
    """From another room; a room's own sub-rooms are neighbours, and know each other's modules."""
    sub_rooms = [
        room for room in ROOMS if len(room.relative_to(ROOT).parts) == 3 or room.parent in {ROOT / "sitl", ROOT / "lab"}
    ]
    faced = [name_of(room) for room in sub_rooms if "__all__" in (room / "__init__.py").read_text(encoding="utf-8")]
    around = {name: name.rpartition(".")[0] if name.count(".") == 2 else name for name in faced}
    wrong = [
        (name_of(path), module)
        for path in CODE
        for module in imported(path)
        for name in faced
        if module.startswith(f"{name}.")
        and not name_of(path).startswith((f"{around[name]}.", f"{name}."))
        and name_of(path) != around[name]
    ]
    assert wrong == []
    assert len(faced) > 15


def test_what_is_at_a_rooms_face_is_taken_from_there_and_what_is_private_by_nobody():
    """What is not at the face is taken from the module that owns it."""
    faces = {
        name_of(room): set(ast.literal_eval(node.value))
        for room in ROOMS
        if len(room.relative_to(ROOT).parts) == 2
        for node in ast.parse((room / "__init__.py").read_text(encoding="utf-8")).body
        if isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == "__all__"
    }
    assert len(faces) > 20
    wrong = []
    for path in CODE:
        me = name_of(path)
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if not isinstance(node, ast.ImportFrom) or node.module is None:
                continue
            room = ".".join(node.module.split(".")[:2])
            if not (ROOT / room.replace(".", "/")).exists() or f"{me}.".startswith(f"{room}."):
                continue
            at_face = faces.get(room, set()) if node.module != room else set()
            wrong += [(me, node.module, a.name) for a in node.names if a.name in at_face or a.name.startswith("_")]
    assert wrong == []


def test_no_name_of_a_face_is_hidden_by_a_module_that_is_loaded_later():
    """A module's first import binds its name in the package: a function of the same name would be gone."""
    hidden = []
    for room in ROOMS:
        face = ast.parse((room / "__init__.py").read_text(encoding="utf-8"))
        loaded = {n.module for n in ast.walk(face) if isinstance(n, ast.ImportFrom)}
        for node in (n for n in ast.walk(face) if isinstance(n, ast.ImportFrom) and n.module is not None):
            hidden += [
                f"{name_of(room)}.{a.name}"
                for a in node.names
                if (room / f"{a.name}.py").exists() and f"{name_of(room)}.{a.name}" not in loaded
            ]
    assert hidden == []
