"""What the command lines of this project share: commands that load when they are asked for, and exit codes.

Every command is a module of the program's ``package`` with ``add_parser(subparsers, summary)``, which sets ``run``, a
function from the parsed arguments to an exit code. Modules are imported when asked for, so ``--help`` does not wait
for numba.

Names come from charts, from other vessels and from file systems; one with an escape sequence in it clears the screen,
moves the cursor over what was said, or types into the shell of who reads.
"""

from __future__ import annotations

import argparse
import contextlib
import difflib
import errno
import importlib
import importlib.util
import os
import re
import signal
import sys
import threading
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType, ModuleType
from typing import TYPE_CHECKING, Any, NoReturn, Protocol, TextIO, cast

from companion import __version__
from companion.disk import reason
from companion.errors import CompanionError, InputError, JobError
from companion.program.arguments import absent_device
from companion.words import one_line, printable

if TYPE_CHECKING:
    from importlib.metadata import EntryPoints


class Writes(Protocol):
    """What takes text."""

    def write(self, text: str, /) -> object:
        """Write ``text``."""
        ...


class SafeStream:
    """A text stream on which nothing but ``control`` moves a cursor; else as the stream that it writes to.

    What the stream's encoding does not have (degrees, in a C locale) is a question mark.
    """

    def __init__(self, stream: TextIO) -> None:
        self._stream = stream

    def write(self, text: str) -> int:
        """Write text as ``printable`` shows it."""
        self.control(printable(text))
        return len(text)

    def writelines(self, lines: Iterable[str]) -> None:
        """Write each of them so."""
        for line in lines:
            self.write(line)

    def control(self, text: str) -> None:
        """Write text as it is."""
        try:
            self._stream.write(text)
        except UnicodeEncodeError:
            self._stream.write(text.encode(self._stream.encoding, "replace").decode(self._stream.encoding))

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)


def control(stream: Writes, text: str) -> None:
    """Write text as it is: what moves the cursor, and what has been made printable."""
    getattr(stream, "control", stream.write)(text)


@contextlib.contextmanager
def safe_streams() -> Iterator[None]:
    """Let standard output and standard error be safe while the body runs, whatever prints there."""
    before = sys.stdout, sys.stderr
    sys.stdout, sys.stderr = (
        stream if stream is None or isinstance(stream, SafeStream) else cast("TextIO", SafeStream(stream))
        for stream in before
    )
    try:
        yield
    finally:
        sys.stdout, sys.stderr = before


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
    "pyogrio": "chart",
    "rasterio": "chart",
    "gribberish": "weather",
    "h5py": "currents",
    "zarr": "currents",
    "filterpy": "shore",
}


def missing(error: ModuleNotFoundError) -> JobError | None:
    """Return what to raise where a library of an extra is not installed, None when another module is missing."""
    library = (error.name or "").partition(".")[0]
    extra = EXTRAS.get(library)
    if extra is None:
        return None
    return JobError(f"{library} is not installed, which this needs; {install(extra)}")


def install(extra: str) -> str:
    """Return what brings an extra: there is no package of this project on an index, so it is the clone's.

    >>> install("plots")
    "in the clone of this project: pip install '.[plots]'"
    """
    return f"in the clone of this project: pip install '.[{extra}]'"


INTERRUPTED = 130
# No option of ours begins with a digit, so this is a value; of all that begins with a minus argparse knows a lone
# number only, and takes a place in the south for an option.
_NEGATIVE = re.compile(r"-\.?\d")


class Parser(argparse.ArgumentParser):
    """A parser that says what is wrong in one line, without reciting its usage, and what was meant."""

    commands: Mapping[str, Parser] = MappingProxyType({})

    def __init__(self, *args: Any, **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        self._negative_number_matcher = _NEGATIVE  # a place is none of argparse's, and would be an option

    def add_subparsers(self, **kwargs: Any) -> Any:
        """Return the subparsers, and keep them by their names."""
        subparsers = super().add_subparsers(**kwargs)
        self.commands = subparsers.choices
        return subparsers

    def parse_known_args(self, args: Sequence[str] | None = None, namespace: Any = None) -> Any:  # type: ignore[override]
        """Take every argument; raise InputError in the name of the command that has no use for one."""
        values, rest = super().parse_known_args(args, namespace)
        if rest:
            self.error(f"unrecognized arguments: {' '.join(rest)}{self._meant(rest[0])}")
        return values, rest

    def _meant(self, argument: str) -> str:
        if argument.endswith(".toml") and "--mission" in self._option_string_actions:
            return f"; a mission is given as --mission {argument}"
        option = argument.partition("=")[0]
        near = difflib.get_close_matches(option, self._option_string_actions, n=1) if option.startswith("--") else []
        return f"; did you mean {near[0]}?" if near else ""

    def error(self, message: str) -> NoReturn:
        """Raise InputError."""
        odd = re.fullmatch(r"(?:argument .+: )?invalid choice: '(.*)' \(choose from .+\)", message, re.DOTALL)
        if odd and self.commands and odd[1] not in self.commands:
            near = difflib.get_close_matches(odd[1], self.commands, n=1)
            message = f"there is no command {odd[1]!r}; " + (
                f"did you mean `{self.prog} {near[0]}`?" if near else f"there are {', '.join(self.commands)}"
            )
        raise InputError(self.prog, "", message, f"'{self.prog} --help' says more")


@dataclass(frozen=True, slots=True, kw_only=True)
class ExtraCommands:
    """Commands in the package of another distribution, which need not be installed; ``remedy`` is what brings it."""

    name: str
    package: str
    commands: Mapping[str, str]
    remedy: str

    @property
    def is_installed(self) -> bool:
        """Whether the package is there."""
        try:
            return importlib.util.find_spec(self.package) is not None
        except ModuleNotFoundError:  # the package that it is in
            return False


@dataclass(frozen=True, slots=True, kw_only=True)
class Program:
    """A command line: its name, what it is for, and the summary of each command in the package of them.

    ``annex`` has further commands, known by name where their package is not installed. ``guests`` is a group of entry
    points (pyproject.toml): commands of packages that this one does not know. Such a module has its summary in
    ``SUMMARY``.
    """

    name: str
    description: str
    package: str
    commands: Mapping[str, str]
    annex: ExtraCommands | None = None
    guests: str = ""

    @property
    def names(self) -> list[str]:
        """The names of all commands that are installed, the guests' last."""
        return [*self._known(), *(point.name for point in self._points())]

    def module(self, name: str) -> ModuleType:
        """Return the module of a command."""
        if name in self.commands:
            return importlib.import_module(f"{self.package}.{name}")
        if self.annex is not None and name in self.annex.commands:
            return importlib.import_module(f"{self.annex.package}.{name}")
        return importlib.import_module(next(point.value for point in self._points() if point.name == name))

    def _known(self) -> Mapping[str, str]:
        """Return the summaries of the commands that are no guests'."""
        return (
            self.commands
            if self.annex is None or not self.annex.is_installed
            else {**self.commands, **self.annex.commands}
        )

    def _points(self) -> EntryPoints | tuple[()]:
        if not self.guests:
            return ()
        from importlib.metadata import entry_points  # most commands have no need of it, and it takes its time

        return entry_points(group=self.guests)

    def summary(self, name: str) -> str:
        """Return what a command does."""
        known = self._known()
        return known[name] if name in known else str(self.module(name).SUMMARY)

    def parser(self, command: str | None = None) -> Parser:
        """Return the parser; only ``command``'s own options are loaded, or all of them when it is None."""
        parser = Parser(
            prog=self.name,
            description=self.description,
            epilog="Exit codes: 0 success, 1 failed job, 2 bad usage or input, 130 ended by Ctrl-C. "
            f"'{self.name} COMMAND --help' says more.",
        )
        parser.add_argument("--version", action="version", version=f"{self.name} {__version__}")
        subparsers = parser.add_subparsers(dest="command", metavar="COMMAND", required=True)
        # entry points are looked for where one is asked for, or all are
        known = self._known()
        for name in known if command in known else self.names:
            if command is None or name == command:
                self.module(name).add_parser(subparsers, self.summary(name))
            else:
                subparsers.add_parser(name, help=self.summary(name), add_help=False)
        return parser

    def run(self, argv: Sequence[str] | None = None) -> int:
        """Run one command of ``argv`` (None: of this process) and return its exit code."""
        with safe_streams():
            return self._run(argv)

    def _run(self, argv: Sequence[str] | None) -> int:
        if sys.maxsize < 2**32:
            sys.stderr.write(
                f"{self.name}: this is a 32-bit system, for which there are no libraries; install "
                "a 64-bit one (Raspberry Pi OS 64-bit)\n"
            )
            return CompanionError.exit_code
        arguments = with_negative_values(sys.argv[1:] if argv is None else argv)
        command = next((a for a in arguments if not a.startswith("-")), None)
        try:
            strange = next((a for a in arguments if re.search("[\ud800-\udfff]", a)), None)
            if strange is not None:  # records and states are UTF-8 and could not name it
                raise InputError(
                    self.name,
                    one_line(strange),
                    f"is not in this system's encoding ({sys.getfilesystemencoding()})",
                    "rename it, or set LANG=C.UTF-8",
                )
            if command is not None and command not in self._known() and command not in self.names:
                raise self._unknown(command)
            args = self.parser(command or "").parse_args(arguments)
        except CompanionError as error:
            sys.stderr.write(f"{error}\n")
            return error.exit_code
        if threading.current_thread() is threading.main_thread():
            # Also where a shell began this in its background, and has it ignore SIGINT: who sends one by hand means it.
            signal.signal(signal.SIGINT, signal.default_int_handler)
        said = absent_device(getattr(args, "link", None))
        if said:
            sys.stderr.write(f"{self.name} {args.command}: {said}\n")
        try:
            with _interrupts_kept():
                code = int(args.run(args))
                if sys.stdout is not None and not sys.stdout.closed:
                    sys.stdout.flush()  # a reader that has gone is met here, and not where nobody answers for it
                return code
        except CompanionError as error:
            called = f"{self.name} {args.command}"
            said = str(error)  # one of a verb's options names the command by itself
            names_itself = said.startswith((f"{called} ", f"{called}: "))
            sys.stderr.write(f"{said}\n" if names_itself else f"{called}: {said}\n")
            return error.exit_code
        except ModuleNotFoundError as error:
            refusal = missing(error)
            if refusal is None:
                raise
            sys.stderr.write(f"{self.name} {args.command}: {refusal}\n")
            return refusal.exit_code
        except KeyboardInterrupt:
            return INTERRUPTED
        except SystemError as error:
            if not _is_interrupt(error):
                raise
            return INTERRUPTED
        except BrokenPipeError:
            with contextlib.suppress(OSError, ValueError):  # what is still to be written goes nowhere
                os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
            return 0
        except OSError as error:
            what = error.filename
            if what is None and error.errno in {errno.ENOSPC, errno.EDQUOT, errno.EIO}:
                with contextlib.suppress(OSError, ValueError):  # nothing more can be written there
                    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
                what = "standard output"
            if what is None:
                raise
            sys.stderr.write(f"{self.name} {args.command}: {one_line(str(what))}: {reason(error)}\n")
            return CompanionError.exit_code

    def _unknown(self, word: str) -> CompanionError:
        """Return what to raise for a command that there is not: it may be a verb of one, or a slip of the pen."""
        if self.annex is not None and word in self.annex.commands:
            return JobError(
                f"{self.name} {word}: {self.annex.name} is not installed, which this needs; {self.annex.remedy}"
            )
        whole = [f"{name} {word}" for name, parser in self.parser().commands.items() if word in parser.commands]
        meant = whole or difflib.get_close_matches(word, self.names, n=1)
        remedy = f"there are {', '.join(self.names)}; '{self.name} --help' says more"
        if meant:
            remedy = f"did you mean {' or '.join(f'`{self.name} {words}`' for words in meant)}?"
        return InputError(self.name, "", f"there is no command {word[:40]!r}", remedy)


AGAIN_S = 0.05  # after which an interrupt that was swallowed comes again


@contextlib.contextmanager
def _interrupts_kept() -> Iterator[None]:
    """Bring an interrupt again that fell into a finalizer or a callback, where nothing can be raised."""
    before = sys.unraisablehook

    def hook(unraisable: sys.UnraisableHookArgs) -> None:
        if issubclass(unraisable.exc_type, KeyboardInterrupt):
            # from a thread: raised here it would be lost once more; as a signal: what waits in the system is woken
            main = threading.main_thread().ident or threading.get_ident()
            threading.Timer(AGAIN_S, lambda: signal.pthread_kill(main, signal.SIGINT)).start()
        else:
            before(unraisable)

    sys.unraisablehook = hook
    try:
        yield
    finally:
        sys.unraisablehook = before


def _is_interrupt(error: BaseException | None) -> bool:
    """Return whether an error came of an interrupt: numba raises another where one falls into a kernel's return."""
    while error is not None and not isinstance(error, KeyboardInterrupt):
        error = error.__cause__ or error.__context__
    return error is not None


def with_negative_values(argv: Sequence[str]) -> list[str]:
    """Return the arguments with a value that begins with a minus and a digit tied to the option before it.

    >>> with_negative_values(["new", "--start", "-33.85,151.26", "--force"])
    ['new', '--start=-33.85,151.26', '--force']
    """
    out: list[str] = []
    for argument in argv:
        if _NEGATIVE.match(argument) and out and out[-1].startswith("--") and out[-1] != "--" and "=" not in out[-1]:
            out[-1] += f"={argument}"
        else:
            out.append(argument)
    return out
