"""What is named with ``companion run``: keys, the page, the satellite link; refused where it cannot be used."""

from __future__ import annotations

import argparse
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

from companion.errors import InputError
from companion.guard import Auxiliary

if TYPE_CHECKING:
    from companion.guard import Guard


def signing_of(path: Path | None) -> Any:
    """Return the key that frames are signed with, None: they are not."""
    if path is None:
        return None
    from companion.mavlink.transports import SigningStore

    return SigningStore(path, time.time())


def page_of(args: argparse.Namespace, guard: Guard) -> Any:
    """Return where the page is served; with a token that cannot be used it takes no orders, which ``guard`` knows.

    Raises InputError: what is named has no page to be used on.
    """
    if args.http is None:
        named = "--http-token" if args.http_token is not None else "--http-name" if args.http_name else (
            "--chart" if args.chart else "")
        if named:
            raise InputError(named, "", "there is no page to use it on", "say where it is served: --http PORT")
        return None
    from companion.page import Address, read_token

    host, port = args.http
    token = ""
    if args.http_token is not None:
        try:
            token = read_token(args.http_token)
        except InputError as error:
            guard.lost(Auxiliary.ORDERS_BY_PAGE, f"{error}", for_good=True)
    return Address(host=host, port=port, names=tuple(args.http_name), token=token)


def charts_of(args: argparse.Namespace, guard: Guard) -> Any:
    """Return the charts; without one that is none, or that a card no longer has, she is sailed all the same."""
    from companion.page import open_charts

    charts: list[Any] = []
    said: list[str] = []
    for path in args.chart:
        try:
            charts += open_charts([path])
        except InputError as error:
            said.append(f"{error}; she is sailed without this chart")
    if said:
        guard.lost(Auxiliary.CHARTS, "; ".join(said), for_good=True)
    return tuple(charts)


def far_of(args: argparse.Namespace, guard: Guard) -> Any:
    """Return the folder of the satellite link with its key, None where it is not wanted or its key cannot be used.

    Raises InputError: no key is named, or no folder.
    """
    if args.far is None:
        if args.far_key is not None:
            raise InputError("--far-key", str(args.far_key), "there is no link to use it on",
                             "name its folder: --far DIR")
        return None
    from companion.app.options import Far
    from companion.mavlink.transports import read_key

    key_file = args.far_key or args.signing_key
    if key_file is None:
        raise InputError("--far", str(args.far), "has no key", "make one with `companion key new far.key` and name it "
                         "with --far-key")
    try:
        return Far(folder=args.far, key=read_key(key_file), every_s=60.0 * args.far_every)
    except InputError as error:
        guard.lost(Auxiliary.FAR, f"{error}", for_good=True)
        return None
