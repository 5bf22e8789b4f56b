"""Where the program begins: whoever ends it while it loads ends it at once, without a traceback."""

import sys

# Built into the interpreter, as nothing else that could come first: while a file is read Ctrl-C would be a traceback.
from _signal import SIG_DFL, SIGINT, signal  # type: ignore[import-not-found]

# Until a command runs, which may have something to put in order. Here, not in main: what pip writes to call that
# compiles a regular expression first.
signal(SIGINT, SIG_DFL)


def main() -> int:
    """Run one command of this process and return its exit code."""
    from companion.cli import main as run

    return run()


if __name__ == "__main__":
    sys.exit(main())
