"""Where the simulator begins: whoever ends it while it loads ends it at once, without a traceback."""

from __future__ import annotations

import signal
import sys


def main() -> int:
    """Run one command of this process and return its exit code."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)   # until a command runs, which may have something to put in order
    from sitl.cli import main as run

    return run()


if __name__ == "__main__":
    sys.exit(main())
