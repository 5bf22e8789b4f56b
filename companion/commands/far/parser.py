"""What ``companion far`` is asked."""

from __future__ import annotations

import argparse
from pathlib import Path

from companion.commands.far.ordering import COUNTER, run_begin, run_order
from companion.commands.far.reading import run_status
from companion.commands.output import force_option
from companion.program.arguments import duration, system_id, whole

_EPILOG = """\
examples:
  companion key new far.key                      (the same file on board: companion run ... --far DIR --far-key far.key)
  companion far order hold --key far.key --expires 2h --out hold.sbd
  companion far order goal 50.8195 -1.3080 --key far.key --expires 90m
  companion far order refuge Mill Bay --key far.key --expires 1d
  companion far begin --key far.key --expires 1d --out begin.sbd     (the counters count from 1 again)
  companion far status status.sbd --key far.key
  companion far status 010600... --key far.key   (as hexadecimal digits, from a web page or a mail)

An order is 24 bytes, and is printed as hexadecimal digits for a web form. How it reaches the boat is the modem's
business: late, twice, or not at all. It counts once, and not after it has expired. What became of it is in the statuses
that follow. To send it again send the same bytes; a new `far order` is a second order. Which verbs are taken is in the
mission: [operator] far_orders = ["hold", ...]. `why` does nothing, and brings a status. Verbs: companion order --help.
Where the boat and this end have lost each other's count (a counter file that is gone, a computer on board that is new,
counters that are used up) begin anew: 15 bytes, after which the next order is number 1.
Exit codes: 0 done, 1 not, 2 a file or option that cannot be believed.
"""


def add_parser(subparsers: argparse._SubParsersAction[argparse.ArgumentParser], summary: str) -> None:
    """Add the command with its verbs."""
    parser = subparsers.add_parser(
        "far", help=summary, description=summary[0].upper() + summary[1:] + ".", epilog=_EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    verbs = parser.add_subparsers(dest="verb", metavar="order|begin|status", required=True)
    order = verbs.add_parser("order", help="make an order of 24 bytes")
    order.add_argument("words", nargs="+", metavar="VERB [ARGS]", help="the order, as for `companion order`")
    begin = verbs.add_parser("begin", help="let the counters of orders count from 1 again")
    begin.set_defaults(run=run_begin)
    for verb in (order, begin):
        verb.add_argument("--expires", type=duration, required=True, metavar="TIME",
                          help="it counts for nothing after so long, at most 7d: 90m, 2h, 1d")
        verb.add_argument("--out", type=Path, metavar="FILE", help="write the bytes there, too")
        force_option(verb)
    order.add_argument("--counter", type=whole(at_least=1, at_most=0xFFFF), metavar="N",
                       help=f"its counter (default: one more than the last, which is kept in KEY{COUNTER}; where that "
                       "file is lost, the boat's status tells the last that she took)")
    order.set_defaults(run=run_order)
    status = verbs.add_parser("status", help="read a status of 42 bytes")
    status.add_argument("source", metavar="FILE|HEX", help="the bytes: in a file, or as hexadecimal digits")
    status.set_defaults(run=run_status)
    for verb in (order, begin, status):
        verb.add_argument("--key", type=Path, required=True, metavar="FILE", help="the key, as on board")
        verb.add_argument("--system", type=system_id, default=1, metavar="N",
                          help="MAVLink system id of the boat's autopilot (default: 1)")
