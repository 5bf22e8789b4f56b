"""Would the tests notice? Changed places of the code: ``python -m bench.mutants [ROOM...] [--sample N] [--jobs N]``

    python -m bench.mutants --sample 40 --seed 7          forty places drawn in each room
    python -m bench.mutants scorer --jobs 2               all of a room's, over two processes
    python -m bench.mutants --again                       those that survived once more, after new tests
    python -m bench.mutants --table                       the table of what is known, and every survivor

First the rooms' tests run once under coverage, which notes for each line the tests that run it (kept until a test or a
line changes). Then each mutant meets the tests that run its line, the room's own and the quickest first, until one
fails. No mutant is ever on the disk: in a forked child of a pytest that has collected everything, the changed code is
put into the functions in memory; where a change is carried out at import (a constant, a field's default), the child
forgets the program and imports it again with that one file changed. A test counts as a killer only when it passes in
such a child without the mutant. What runs longer than a minute and ten times what its tests take is killed, too.

Verdicts stay in ``build/mutants.jsonl`` as they come and are found again by the file's text: the same command goes on.
``bench/equivalent_mutants.txt`` names those that change nothing, "equivalent, because". Functions that numba compiles
are left out: a mutant of one costs a compilation of all that calls it.
"""

from __future__ import annotations

import argparse
import ast
import contextlib
import gc
import hashlib
import importlib.abc
import importlib.util
import json
import os
import random
import re
import signal
import sys
import tempfile
import time
from collections import Counter, defaultdict
from collections.abc import Iterator, Sequence
from collections.abc import Set as AbstractSet
from copy import deepcopy
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from types import CodeType, FunctionType

import pytest

ROOT = Path(__file__).parents[1]
KEPT = ROOT / "build"
EQUIVALENT = ROOT / "bench/equivalent_mutants.txt"
# What is run for a room: its files, and the tests that are to hold them.
ROOMS: dict[str, tuple[tuple[str, ...], tuple[str, ...]]] = {
    "scorer": (
        ("companion/planner/problem/*.py",),
        ("tests/planner/problem", "tests/planner/risk", "tests/planner/track", "tests/planner/test_bad_input.py"),
    ),
    "risk": (("companion/planner/risk/*.py",), ("tests/planner/risk",)),
    "track": (("companion/planner/track/*.py",), ("tests/planner/track",)),
    "triggers": (("companion/skipper/planning/t*.py", "companion/skipper/planning/w*.py"), ("tests/skipper",)),
    "behaviors": (
        tuple(
            f"companion/skipper/behaviors/{name}.py"
            for name in ("headings", "helm", "launch", "operator_orders", "rest", "sailing", "drifting")
        ),
        ("tests/skipper",),
    ),
    "failsafes": (
        tuple(f"companion/skipper/behaviors/{name}.py" for name in ("failsafe", "position_doubt", "wind_doubt")),
        ("tests/skipper",),
    ),
    "safety": (
        ("companion/safety.py", "companion/skipper/rules.py", "companion/skipper/priorities.py"),
        ("tests/skipper", "tests/house/test_documents.py"),
    ),
    "custody": (("companion/skipper/board/*.py",), ("tests/skipper",)),
    "watchdogs": (("companion/skipper/watch/*.py",), ("tests/skipper",)),
    "fence proof": (
        (
            "companion/geofence/autopilot_fence.py",
            "companion/geofence/area.py",
            "companion/skipper/way/autopilot_fence.py",
        ),
        ("tests/geofence", "tests/skipper/way"),
    ),
    "trust": (
        ("companion/skipper/way/position_plausibility.py", "companion/wind/sensor_faults.py"),
        ("tests/skipper/way", "tests/wind"),
    ),
    "signing": (("companion/mavlink/signing.py",), ("tests/mavlink", "tests/commands/test_key.py")),
    "far codec": (("companion/orders/far/*.py",), ("tests/orders/far", "tests/house/test_documents.py")),
    "uploads": (
        (
            "companion/skipper/planning/uploads.py",
            "companion/mavlink/mission_lists.py",
            "companion/mavlink/microservices/mission.py",
            "companion/mavlink/wire/items.py",
        ),
        ("tests/mavlink", "tests/skipper/planning"),
    ),
    "formats": (("companion/geofence/formats/*.py",), ("tests/geofence/formats",)),
    "true wind": (("companion/wind/true_wind.py", "companion/wind/tracker.py"), ("tests/wind",)),
}
# Tests of seconds are not asked (tests/long.txt).
PYTEST = ("-q", "-s", "-n0", "-p", "no:cacheprovider", "-m", "not campaign and not long")
TESTS_S = 60.0  # for one mutant: a line that a thousand tests run is judged by the quickest of them


@dataclass(frozen=True, slots=True)
class Mutant:
    """A place of a file and what stands there instead."""

    room: str
    file: str
    where: str  # the function's qualified name, "" at import
    line: int
    column: int
    number: int  # of the place's changes
    told: str  # what stands there -> what is put there
    is_at_import: bool
    last_line: int  # of what is changed: a condition over several lines is not run on its first

    @property
    def key(self) -> str:
        """What it is known by, as long as its file is as it is."""
        return f"{self.file}:{self.line}:{self.column}:{self.number}"

    @property
    def row(self) -> str:
        """What it is named by in the list of those that change nothing, wherever its line may move to."""
        line = source(self.file)[self.line - 1].strip()
        return f"{self.file} | {self.where} | {self.told} | {line}"


@cache
def source(file: str) -> list[str]:
    """Return the lines of a file."""
    return (ROOT / file).read_text(encoding="utf-8").splitlines()


COMPARISONS: dict[type[ast.cmpop], tuple[type[ast.cmpop], ...]] = {
    ast.Lt: (ast.LtE, ast.GtE),
    ast.LtE: (ast.Lt, ast.Gt),
    ast.Gt: (ast.GtE, ast.LtE),
    ast.GtE: (ast.Gt, ast.Lt),
    ast.Eq: (ast.NotEq,),
    ast.NotEq: (ast.Eq,),
    ast.Is: (ast.IsNot,),
    ast.IsNot: (ast.Is,),
    ast.In: (ast.NotIn,),
    ast.NotIn: (ast.In,),
}
OPERATORS: dict[type[ast.operator], type[ast.operator]] = {
    ast.Add: ast.Sub,
    ast.Sub: ast.Add,
    ast.Mult: ast.Div,
    ast.Div: ast.Mult,
    ast.FloorDiv: ast.Mult,
    ast.Mod: ast.Mult,
    ast.Pow: ast.Mult,
    ast.LShift: ast.RShift,
    ast.RShift: ast.LShift,
    ast.BitAnd: ast.BitOr,
    ast.BitOr: ast.BitAnd,
    ast.BitXor: ast.BitOr,
}
CALLS = {
    "min": "max",
    "max": "min",
    "any": "all",
    "all": "any",
    "sin": "cos",
    "cos": "sin",
    "floor": "ceil",
    "ceil": "floor",
}


def changes(node: ast.AST) -> Iterator[ast.AST]:
    """Yield what may stand in a node's place."""
    match node:
        case ast.Compare(left=left, ops=[op], comparators=right):
            for other in COMPARISONS[type(op)]:
                yield ast.Compare(left=left, ops=[other()], comparators=right)
        case ast.Compare(left=left, ops=ops, comparators=right):
            for n, op in enumerate(ops):
                yield ast.Compare(
                    left=left, ops=[*ops[:n], COMPARISONS[type(op)][0](), *ops[n + 1 :]], comparators=right
                )
        case ast.BinOp(left=left, op=op, right=right) if type(op) in OPERATORS:
            if not (
                isinstance(op, ast.Mod | ast.Add)
                and isinstance(left, ast.Constant | ast.JoinedStr)
                and not number(left)
            ):
                yield ast.BinOp(left=left, op=OPERATORS[type(op)](), right=right)
        case ast.AugAssign(target=target, op=op, value=value) if type(op) in OPERATORS:
            yield ast.AugAssign(target=target, op=OPERATORS[type(op)](), value=value)
        case ast.BoolOp(op=op, values=values):
            yield ast.BoolOp(op=ast.Or() if isinstance(op, ast.And) else ast.And(), values=values)
        case ast.UnaryOp(op=ast.Not() | ast.USub(), operand=operand):
            yield operand
        case ast.Constant(value=bool(value)):
            yield ast.Constant(value=not value)
        case ast.Constant(value=int(value)):
            yield ast.Constant(value=value + 1)
        case ast.Constant(value=float(value)):
            yield ast.Constant(value=1.5 * value + (value == 0.0))
        case ast.IfExp(test=test, body=body, orelse=orelse):
            yield ast.IfExp(test=test, body=orelse, orelse=body)
        case ast.If(test=test, body=body, orelse=orelse) if not isinstance(test, ast.Compare | ast.UnaryOp):
            yield ast.If(test=ast.UnaryOp(op=ast.Not(), operand=test), body=body, orelse=orelse)
        case ast.Call(func=ast.Name(id=name) as func, args=args, keywords=keywords) if name in CALLS:
            yield ast.Call(func=ast.Name(id=CALLS[name], ctx=func.ctx), args=args, keywords=keywords)
        case ast.Call(func=ast.Attribute(value=value, attr=name, ctx=ctx), args=args, keywords=keywords) if (
            name in CALLS
        ):
            yield ast.Call(func=ast.Attribute(value=value, attr=CALLS[name], ctx=ctx), args=args, keywords=keywords)
        case ast.Return(value=ast.expr() as value) if not isinstance(value, ast.Constant):
            yield ast.Return(value=ast.Constant(value=None))
        case ast.Expr(value=ast.Call()) | ast.Break() | ast.Continue():
            yield ast.Pass()


def number(node: ast.AST) -> bool:
    """Whether it is a plain number."""
    return isinstance(node, ast.Constant) and isinstance(node.value, int | float)


# What a keyword of such a name is given, and what a function of such a name returns, is for a person to read.
SAID = re.compile(r"(^|_)(text|why|words|sentence|because|until|does|when|title|help)$")
WORDS = re.compile(r"(^|_)(words|sentence)$")


def is_sentence(node: ast.AST) -> bool:
    """Whether it is a text of several words, or made of parts; a single word may be a key."""
    return isinstance(node, ast.JoinedStr) or (
        isinstance(node, ast.Constant) and isinstance(node.value, str) and " " in node.value
    )


def is_wording(node: ast.AST) -> bool:
    """Whether a change there changes but the words of a message."""
    match node:
        case ast.IfExp(body=body, orelse=orelse):  # which of two sentences
            return is_sentence(body) and is_sentence(orelse)
        case ast.keyword(arg=str(name)):
            return SAID.search(name) is not None
        case ast.Call(func=ast.Attribute(attr="debug" | "info" | "warning" | "exception", value=ast.Name(id=log))):
            return log in {"log", "logger", "LOG", "_log"}
        case ast.Expr(value=ast.Call() as call):
            return is_wording(call)
        case ast.FunctionDef(name=name, returns=ast.Name(id="str")):
            return WORDS.search(name) is not None
    return False


def places(tree: ast.Module) -> Iterator[tuple[ast.AST, str, bool, bool]]:
    """Yield each node that may be changed, its function, whether it is carried out at import and is wording only.

    Left out are annotations, what an assert or a raise says, ``__all__``, what only a type checker reads, and kernels.
    """

    def walk(node: ast.AST, where: str, inside: bool, said: bool) -> Iterator[tuple[ast.AST, str, bool, bool]]:
        for name, value in ast.iter_fields(node):
            if name in {"annotation", "returns", "type_params", "ctx", "ops", "op", "decorator_list"}:
                continue
            if name == "slice" and isinstance(value, ast.Constant) and isinstance(value.value, str):
                continue
            for child in value if isinstance(value, list) else [value]:
                if not isinstance(child, ast.AST) or isinstance(child, ast.Assert | ast.Raise | ast.JoinedStr):
                    continue
                if isinstance(child, ast.Assign) and getattr(child.targets[0], "id", "") == "__all__":
                    continue
                if isinstance(child, ast.If) and getattr(child.test, "id", "") == "TYPE_CHECKING":
                    continue
                if isinstance(child, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
                    if any(getattr(d, "id", "") == "kernel" for d in child.decorator_list):
                        continue
                    here = f"{where}{'.<locals>.' if inside else '.' if where else ''}{child.name}"
                    yield from walk(child, here, not isinstance(child, ast.ClassDef), said or is_wording(child))
                    continue
                if isinstance(child, ast.arguments):  # defaults are reckoned where the function is made
                    for default in (*child.defaults, *(d for d in child.kw_defaults if d is not None)):
                        yield default, where, ".<locals>." in where, said
                        yield from walk(default, where, ".<locals>." in where, said)
                    continue
                below = said or is_wording(child)
                yield child, where, inside, below
                yield from walk(child, where, inside, said or (below and not isinstance(child, ast.IfExp)))

    for node, where, inside, said in walk(tree, "", False, False):
        yield node, where, not inside, said


def mutants(room: str, file: str) -> Iterator[Mutant]:
    """Yield all mutants of a file but those that change the words of a message, and nothing else."""
    seen: Counter[tuple[int, int]] = Counter()
    for node, where, is_at_import, is_said in places(ast.parse((ROOT / file).read_text(encoding="utf-8"))):
        for other in changes(node):
            place = node.lineno, node.col_offset
            seen[place] += 1
            if is_said:
                continue
            was, now = (ast.unparse(ast.fix_missing_locations(n)).splitlines()[0] for n in (node, deepcopy(other)))
            last_line = (node.test if isinstance(node, ast.If) else node).end_lineno or node.lineno
            yield Mutant(room, file, where, *place, seen[place], f"{was} -> {now}", is_at_import, last_line)


def mutated(mutant: Mutant) -> CodeType:
    """Return the file's code with the one place changed."""
    tree = ast.parse((ROOT / mutant.file).read_text(encoding="utf-8"))
    seen: Counter[tuple[int, int]] = Counter()
    for node, *_ in places(tree):
        for other in changes(node):
            place = node.lineno, node.col_offset
            seen[place] += 1
            if (*place, seen[place]) == (mutant.line, mutant.column, mutant.number):
                changed = Replace(node, ast.copy_location(other, node)).visit(tree)
                return compile(ast.fix_missing_locations(changed), str(ROOT / mutant.file), "exec", dont_inherit=True)
    raise LookupError(mutant.key)


class Replace(ast.NodeTransformer):
    """Puts another node in one node's place."""

    def __init__(self, node: ast.AST, other: ast.AST) -> None:
        self.node, self.other = node, other

    def visit(self, node: ast.AST) -> ast.AST:
        return self.other if node is self.node else self.generic_visit(node)


def codes(code: CodeType) -> Iterator[CodeType]:
    """Yield a code and all that are made in it."""
    yield code
    for constant in code.co_consts:
        if isinstance(constant, CodeType):
            yield from codes(constant)


def module_of(file: str) -> str:
    """Return the name that a file is imported by."""
    return ".".join(Path(file).with_suffix("").parts).removesuffix(".__init__")


class OneFileChanged(importlib.abc.MetaPathFinder, importlib.abc.Loader):
    """Imports one module from changed code, all others as ever."""

    def __init__(self, file: str, code: CodeType) -> None:
        self.name = module_of(file)
        self.path, self.code = ROOT / file, code

    def find_spec(self, fullname, _path=None, _target=None):
        if fullname != self.name:
            return None
        package = [str(self.path.parent)] if self.path.name == "__init__.py" else None
        return importlib.util.spec_from_file_location(
            fullname, self.path, loader=self, submodule_search_locations=package
        )

    def create_module(self, _spec):
        return None

    def exec_module(self, module):
        exec(self.code, module.__dict__)


class Failed:
    """A pytest plugin: the first test that failed."""

    test: str | None = None

    def pytest_runtest_logreport(self, report):
        if report.failed and self.test is None:
            self.test = report.nodeid


class Covering:
    """A pytest plugin: the lines that each test runs. What a fixture runs stands under its tests' file."""

    def __init__(self, files: Sequence[str]) -> None:
        import coverage

        self.files = files
        self.cover = coverage.Coverage(
            data_file=None, include=[str(ROOT / f) for f in files], config_file=False, messages=False
        )
        self.cover.set_option("run:core", "ctrace")  # which sees every line again in each context
        self.took: dict[str, float] = {}
        self.bad: set[str] = set()

    def pytest_collection_finish(self):
        self.cover.start()

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_protocol(self, item):
        if sys.gettrace() is None:  # the interpreter takes a tracer away in which a stack ran over, as a test wants it
            self.cover.stop()
            self.cover.start()
        self.cover.switch_context(file_of(item.nodeid))
        began = time.perf_counter()
        done = yield
        self.took[item.nodeid] = round(time.perf_counter() - began, 3)
        return done

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_call(self, item):
        self.cover.switch_context(item.nodeid)
        try:
            return (yield)
        finally:
            self.cover.switch_context(file_of(item.nodeid))

    def pytest_runtest_logreport(self, report):
        if report.failed or report.skipped:
            self.bad.add(report.nodeid)

    def ran(self) -> dict[str, dict[str, str]]:
        """Return, for each test and file of tests, the lines of each file of code: its text's digest, bits in hex."""
        self.cover.stop()
        masks: dict[str, Counter[str]] = defaultdict(Counter)
        for file in self.files:
            for line, contexts in self.cover.get_data().contexts_by_lineno(str(ROOT / file)).items():
                for context in contexts:
                    masks[context][file] += 1 << line
        texts = {file: text_of(file) for file in self.files}
        return {
            context: {file: f"{texts[file]}:{mask:x}" for file, mask in of.items()}
            for context, of in masks.items()
            if context
        }


class Coverage:
    """Which tests run a line, kept in a file: what a changed test or a changed file of code asks for is run again."""

    def __init__(self, path: Path, files: Sequence[str], asked: AbstractSet[str]) -> None:
        self.path, self.files, self.asked = path, files, asked
        self.texts: dict[str, str] = {}
        self.took: dict[str, float] = {}
        self.ran: dict[str, dict[str, str]] = {}
        self._read()

    def _read(self) -> None:
        """Read what is known and forget the tests that are of another text, or ran another of what is asked for."""
        if self.path.exists():
            kept = json.loads(self.path.read_text())
            self.texts, self.took, self.ran = kept["texts"], kept["took"], kept["ran"]
        now = {file: text_of(file) for file in self.asked}
        other = {
            file_of(ran)
            for ran, of in self.ran.items()
            if any(lines.partition(":")[0] != now[file] for file, lines in of.items() if file in now)
        }
        self._forget(other | {test for test, text in self.texts.items() if text != text_of(test)})

    def _forget(self, tests: AbstractSet[str]) -> None:
        self.took = {t: s for t, s in self.took.items() if file_of(t) not in tests}
        self.ran = {r: of for r, of in self.ran.items() if file_of(r) not in tests}
        self.texts = {t: text for t, text in self.texts.items() if t not in tests}

    def renew(self, tops: Sequence[str]) -> None:
        """Run what of the tests below ``tops`` is new or changed, or runs code which is."""
        stale = sorted(t for t in tests_below(tops) if t not in self.texts)
        if stale:
            texts = {t: text_of(t) for t in stale}
            plugin = Covering(self.files)
            pytest.main([*PYTEST, *stale], plugins=[plugin])
            self._read()  # another run may have written meanwhile
            self._forget(set(stale))
            self.took |= {t: s for t, s in plugin.took.items() if t not in plugin.bad}
            self.ran |= plugin.ran()
            self.texts |= texts
        part = self.path.with_suffix(f".{os.getpid()}")
        part.write_text(json.dumps({"texts": self.texts, "took": self.took, "ran": self.ran}))
        part.replace(self.path)

    def of(self, file: str) -> dict[int, set[str]]:
        """Return the tests of each line of a file."""
        in_file: dict[str, list[str]] = defaultdict(list)
        for test in self.took:
            in_file[file_of(test)].append(test)
        lines: dict[int, set[str]] = defaultdict(set)
        for ran, of in self.ran.items():
            mask, line = int(of.get(file, ":0").partition(":")[2], 16), 0
            tests = [ran] if ran in self.took else in_file[ran]
            while mask:
                if mask & 1:
                    lines[line].update(tests)
                mask, line = mask >> 1, line + 1
        return lines


def tests_below(tops: Sequence[str]) -> set[str]:
    """Return the files of tests in these folders, and those that are named."""
    inside = {str(p.relative_to(ROOT)) for top in tops for p in ROOT.glob(f"{top}/**/test_*.py")}
    return inside | {top for top in tops if top.endswith(".py")}


def file_of(test: str) -> str:
    """Return the file of a test."""
    return test.partition("::")[0]


class Judge:
    """A pytest plugin in place of its loop: a forked child for each mutant."""

    def __init__(
        self,
        wanted: Sequence[Mutant],
        known: Coverage,
        jobs: int,
        tests_s: float,
        verdicts: Path,
        until_s: float,
        only: Sequence[str],
    ) -> None:
        self.tests_s, self.only = tests_s, tuple(only)
        self.lines: dict[str, dict[int, set[str]]] = {}
        self.wanted, self.known, self.jobs, self.verdicts, self.until_s = wanted, known, jobs, verdicts, until_s
        self.sound: dict[tuple[tuple[str, ...], bool], bool] = {}
        self.texts = {mutant.file: text_of(mutant.file) for mutant in wanted}
        self.functions: dict[str, list[FunctionType]] = defaultdict(list)
        self.items: dict[str, pytest.Item] = {}

    def chosen(self, mutant: Mutant) -> list[str]:
        """Return the tests for a mutant: of its room, the quickest first."""
        if mutant.file not in self.lines:
            self.lines[mutant.file] = self.known.of(mutant.file)
        lines, took = self.lines[mutant.file], self.known.took
        own = self.only or ROOMS[mutant.room][1]
        tests = set().union(*(lines.get(line, set()) for line in range(mutant.line, mutant.last_line + 1)))
        if mutant.is_at_import:  # whatever runs the file, and the room's files of tests: to read a table runs no line
            named = {test for test in took if file_of(test) in own}
            tests = set().union(named, *lines.values())
        tests = {test for test in tests if test.startswith(own)}
        kept, left_s = [], self.tests_s
        for test in sorted(tests, key=lambda t: (took[t], t)):
            left_s -= took[test]
            if left_s < 0.0:
                break
            kept.append(test)
        return kept

    def run(self, tests: Sequence[str], mutant: Mutant | None, is_at_import: bool) -> str | None:
        """Run tests in this process, which is a child; return the first that failed."""
        told = Failed()
        code = mutated(mutant) if mutant is not None else None
        if is_at_import:
            for name in [
                n
                for n in sys.modules
                if n.partition(".")[0] in {"companion", "sitl", "lab", "bench", "tests", "conftest"}
            ]:
                del sys.modules[name]
            if mutant is not None and code is not None:
                sys.meta_path.insert(0, OneFileChanged(mutant.file, code))
            ended = pytest.main(
                ["-x", "-q", "-s", "-n0", "-p", "no:cacheprovider", "-m", "not campaign", *tests], plugins=[told]
            )
            return told.test or (f"exit {ended}" if ended else None)
        if mutant is not None and code is not None:
            new = {(c.co_qualname, c.co_firstlineno): c for c in codes(code)}
            for function in self.functions[str(ROOT / mutant.file)]:
                old = function.__code__
                other = new.get((old.co_qualname, old.co_firstlineno))
                if other is not None and other != old and other.co_freevars == old.co_freevars:
                    function.__code__ = other
        manager = self.session.config.pluginmanager
        manager.register(told)
        items = [self.items[t] for t in tests if t in self.items]
        for item, following in zip(items, [*items[1:], None], strict=True):
            item.config.hook.pytest_runtest_protocol(item=item, nextitem=following)
            if told.test is not None:
                return told.test
        return None

    def child(self, tests: Sequence[str], mutant: Mutant | None, is_at_import: bool) -> tuple[int, Path]:
        """Fork; return the child's number and the file of its answer."""
        handle, name = tempfile.mkstemp(dir=KEPT, prefix="mutant-")
        pid = os.fork()
        if pid:
            os.close(handle)
            return pid, Path(name)
        status = 70
        try:
            os.setsid()
            null = os.open(os.devnull, os.O_RDWR)
            for descriptor in (0, 1, 2):
                os.dup2(null, descriptor)
            os.write(handle, json.dumps(self.run(tests, mutant, is_at_import)).encode())
            status = 0
        except BaseException as error:
            os.write(handle, json.dumps(f"ended by {type(error).__name__}").encode())
            status = 0
        finally:
            os._exit(status)

    def is_sound(self, tests: Sequence[str], is_at_import: bool) -> bool:
        """Whether tests pass in such a child without any mutant."""
        asked = tuple(tests), is_at_import
        if asked not in self.sound:
            pid, answer = self.child(tests, None, is_at_import)
            os.waitpid(pid, 0)
            self.sound[asked] = answer.read_text() == "null"
            answer.unlink()
        return self.sound[asked]

    @pytest.hookimpl(tryfirst=True)
    def pytest_runtestloop(self, session):
        self.session = session
        self.items = {item.nodeid: item for item in session.items}
        for file in self.texts:  # what is imported late, in a child, would come from the disk, and not be changed
            importlib.import_module(module_of(file))
        for function in gc.get_objects():
            if type(function) is FunctionType:
                self.functions[function.__code__.co_filename].append(function)
        gc.freeze()
        waiting = [(mutant, self.chosen(mutant)) for mutant in reversed(self.wanted)]
        running: dict[int, tuple[Mutant, list[str], Path, float, float]] = {}
        done = 0
        while waiting or running:
            while waiting and len(running) < self.jobs and time.monotonic() < self.until_s:
                mutant, tests = waiting.pop()
                if text_of(mutant.file) != self.texts[mutant.file]:
                    continue  # somebody writes in it: what was drawn is another place by now
                if not tests:
                    done += 1
                    self.keep(mutant, "survived", "no test runs it", done)
                    continue
                pid, answer = self.child(tests, mutant, mutant.is_at_import)
                began = time.monotonic()
                limit_s = 60.0 + 60.0 * mutant.is_at_import + 10.0 * sum(self.known.took[t] for t in tests)
                running[pid] = mutant, tests, answer, began, began + limit_s
            if not running:
                break
            pid, _ = os.waitpid(-1, os.WNOHANG)
            for late in [p for p, (*_, until) in running.items() if p != pid and until < time.monotonic()]:
                with contextlib.suppress(ProcessLookupError):  # its group is made by itself, and may have ended
                    os.killpg(late, signal.SIGKILL)
            if not pid:
                time.sleep(0.02)
                continue
            if pid not in running:
                continue
            mutant, tests, answer, began, until = running.pop(pid)
            said = answer.read_text()
            answer.unlink()
            by = json.loads(said) if said else "time" if time.monotonic() > until else "died"
            if by is None:
                done += 1
                self.keep(mutant, "survived", f"{len(tests)} tests", done)
            elif text_of(mutant.file) != self.texts[mutant.file]:
                continue
            elif "::" in by and not self.is_sound([by], mutant.is_at_import):
                waiting.append((mutant, [t for t in tests if t != by]))
            elif "::" not in by and by not in {"time", "died"} and not self.is_sound(tests, mutant.is_at_import):
                done += 1  # they cannot even be asked here
                self.keep(mutant, "survived", f"{by} without it, too", done)
            else:
                done += 1
                self.keep(mutant, "killed", by, done)
        return True

    def keep(self, mutant: Mutant, verdict: str, by: str, done: int) -> None:
        """Append a verdict."""
        record = {
            "key": mutant.key,
            "text": self.texts[mutant.file],
            "room": mutant.room,
            "where": mutant.where,
            "told": mutant.told,
            "verdict": verdict,
            "by": by,
        }
        with self.verdicts.open("a") as file:
            file.write(json.dumps(record) + "\n")
        if verdict == "survived" or done % 25 == 0:
            sys.stdout.write(f"{done}/{len(self.wanted)} {verdict} {mutant.key} {mutant.told} ({by})\n")
            sys.stdout.flush()


def text_of(file: str) -> str:
    """Return a digest of a file's text."""
    path = ROOT / file
    return hashlib.sha256(path.read_bytes()).hexdigest()[:12] if path.exists() else ""


def known_verdicts(path: Path) -> dict[str, dict[str, str]]:
    """Return the last verdict on each mutant of the files as they are."""
    if not path.exists():
        return {}
    texts: dict[str, str] = {}
    last: dict[str, dict[str, str]] = {}
    for record in map(json.loads, path.read_text().splitlines()):
        file = record["key"].partition(":")[0]
        if file not in texts:
            texts[file] = text_of(file)
        if record["text"] == texts[file]:
            last[record["key"]] = record
    return last


def equivalents() -> set[str]:
    """Return the rows of those that change nothing."""
    return {r for r in EQUIVALENT.read_text(encoding="utf-8").splitlines() if r and not r.startswith(("#", " "))}


def drawn(rooms: Sequence[str], sample: int | None, seed: int) -> list[Mutant]:
    """Return the rooms' mutants, or so many of each, drawn by seed."""
    chosen: list[Mutant] = []
    for room in rooms:
        files = sorted({str(p.relative_to(ROOT)) for glob in ROOMS[room][0] for p in ROOT.glob(glob)})
        of_room = [m for file in files for m in mutants(room, file)]
        if sample is not None and sample < len(of_room):
            of_room = random.Random(f"{seed} {room}").sample(of_room, sample)
        chosen += of_room
    return chosen


def table(last: dict[str, dict[str, str]], out) -> None:
    """Write the table of the rooms, and the survivors."""
    same = equivalents()
    out.write("| room | mutants | tried | killed | equivalent | survived | noticed |\n|---|---|---|---|---|---|---|\n")
    left = []
    for room in ROOMS:
        of_room = {m.key: m for m in drawn([room], None, 0)}
        tried = [(of_room[k], r) for k, r in last.items() if k in of_room]
        killed = sum(r["verdict"] == "killed" for _, r in tried)
        survivors = [m for m, r in tried if r["verdict"] == "survived"]
        true = [m for m in survivors if m.row not in same]
        left += true
        held = killed + len(true)
        share = f"{100.0 * killed / held:.0f} %" if held else "–"
        figures = len(of_room), len(tried), killed, len(survivors) - len(true), len(true), share
        out.write(f"| {' | '.join(map(str, (room, *figures)))} |\n")
    for mutant in left:
        out.write(f"{mutant.row}\n")


def main(argv: Sequence[str] | None = None) -> int:
    """Judge what was asked for; print the table."""
    parser = argparse.ArgumentParser(prog="python -m bench.mutants", description=__doc__.splitlines()[0])
    parser.add_argument("rooms", nargs="*", metavar="ROOM", help=", ".join(ROOMS))
    parser.add_argument("--sample", type=int, metavar="N", help="so many of each room, drawn by --seed")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--jobs", type=int, default=1, metavar="N", help="processes")
    parser.add_argument(
        "--tests-s", type=float, default=TESTS_S, metavar="S", help="of tests for one mutant (default 60)"
    )
    parser.add_argument("--minutes", type=float, default=1e6, help="begin no mutant after them")
    parser.add_argument("--again", action="store_true", help="judge once more what survived")
    parser.add_argument(
        "--tests", nargs="+", default=[], metavar="PATH", help="ask these alone: what survives them may be killed yet"
    )
    parser.add_argument("--table", action="store_true", help="only the table of what is known")
    args = parser.parse_args(argv)
    if unknown := set(args.rooms) - set(ROOMS):
        parser.error(f"there is no {min(unknown)}. Rooms: {', '.join(ROOMS)}")
    KEPT.mkdir(exist_ok=True)
    verdicts, until_s = KEPT / "mutants.jsonl", time.monotonic() + 60.0 * args.minutes
    last = known_verdicts(verdicts)
    rooms = args.rooms or list(ROOMS)
    if not args.table:
        os.chdir(ROOT)
        wanted = drawn(rooms, args.sample, args.seed)
        if args.again:
            wanted = [m for m in wanted if last.get(m.key, {}).get("verdict") == "survived"]
        else:
            wanted = [m for m in wanted if m.key not in last]
        files, asked = sorted({m.file for m in drawn(list(ROOMS), None, 0)}), {m.file for m in wanted}
        known = KEPT / "mutants.coverage.json"
        tops = sorted(args.tests or {top for room in rooms for top in ROOMS[room][1]})
        if wanted:
            if not (pid := os.fork()):  # a process of its own: nothing that the tests leave stays in those that judge
                Coverage(known, files, asked).renew(tops)
                os._exit(0)
            if os.waitpid(pid, 0)[1]:
                return 1
            judge = Judge(wanted, Coverage(known, files, asked), args.jobs, args.tests_s, verdicts, until_s, args.tests)
            pytest.main([*PYTEST, *tops], plugins=[judge])
        last = known_verdicts(verdicts)
    table(last, sys.stdout)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
