"""Golden recordings: loading them and letting a step machine relive them."""

from pathlib import Path

from companion.mavlink.microservices.command import Party
from companion.mavlink.tlog import read_tlog
from companion.mavlink.wire import Codec

DATA = Path(__file__).parent / "data"
PARTY = Party(1, 1, 1, 191)


def messages_of(records):
    """Return [(seconds since 1970, message)] of records of a log."""
    codec = Codec(1, 191)
    return [(record.unix_us / 1e6, message) for record in records for message in codec.feed(record.frame)]


def load(name):
    """Return [(seconds from the first record, message)] of a recording."""
    records = messages_of(read_tlog(DATA / f"{name}.tlog"))
    start_s = records[0][0]
    return [(t_s - start_s, message) for t_s, message in records]


def said(messages, component):
    return [m for _, m in messages if m.get_srcComponent() == component]


def fields(message):
    return message.to_dict()


def relive(machine, messages):
    """Start the machine at the first message and give it the autopilot's; return what it sent, in order."""
    sent = list(machine.start(messages[0][0]))
    for t_s, message in messages:
        while machine.result is None and machine.wake_s < t_s:
            sent += machine.tick(machine.wake_s)
        if message.get_srcComponent() == 1:
            sent += machine.receive(t_s, message)
    for _ in range(40):
        if machine.result is not None:
            break
        sent += machine.tick(machine.wake_s)
    return sent


def between(messages, low_s, high_s):
    return [(t_s, m) for t_s, m in messages if low_s <= t_s <= high_s]
