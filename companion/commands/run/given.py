"""What is named with ``companion run``: keys, the page, the satellite link; refused where it cannot be used."""

from __future__ import annotations

import argparse
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

from companion.errors import InputError

if TYPE_CHECKING:
    from companion.telemetry.console import Console


def signing_of(path: Path | None) -> Any:
    """Return the key that frames are signed with, None: they are not."""
    if path is None:
        return None
    from companion.mavlink.transports import SigningStore

    return SigningStore(path, time.time())


def page_of(args: argparse.Namespace) -> Any:
    """Return where the page is served. Raises InputError: the token cannot be used."""
    if args.http is None:
        named = "--http-token" if args.http_token is not None else "--http-name" if args.http_name else (
            "--chart" if args.chart else "")
        if named:
            raise InputError(named, "", "there is no page to use it on", "say where it is served: --http PORT")
        return None
    from companion.page import Address, read_token

    host, port = args.http
    return Address(host=host, port=port, names=tuple(args.http_name),
                   token="" if args.http_token is None else read_token(args.http_token))


def charts_of(args: argparse.Namespace, err: Console) -> Any:
    """Return the charts; without one that is none, or that a card no longer has, she is sailed all the same."""
    from companion.page import open_charts

    charts: list[Any] = []
    for path in args.chart:
        try:
            charts += open_charts([path])
        except InputError as error:
            err.write(f"companion run: note: {error}; she is sailed without this chart\n")
    return tuple(charts)


def far_of(args: argparse.Namespace) -> Any:
    """Return the folder of the satellite link with its key. Raises InputError: it cannot be used."""
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
    return Far(folder=args.far, key=read_key(key_file), every_s=60.0 * args.far_every)
