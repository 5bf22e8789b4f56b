"""Mission, fence and rally lists by the item protocol: upload, partial upload, download, clear. Pure step machines.

Written for what ArduRover does: it asks with MISSION_REQUEST, repeats a request every second, gives up after 8 s with
ACK 15; an item out of sequence earns ACK 13 and the upload goes on; a refusal cuts the mission and is explained by a
STATUSTEXT that comes after the ACK.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from pymavlink.dialects.v20 import ardupilotmega as wire

from companion.mavlink.microservices.command import REASON_WAIT_S, Party, Retransmission, Texts, TransferOutcome
from companion.mavlink.wire.codec import mission_item, mission_item_int
from companion.mavlink.wire.frames import Message
from companion.messages import MissionItem, MissionType

# ArduRover repeats its request every 1 s: silence for longer than this with all items sent means a lost last ACK [s].
LAST_ACK_WAIT_S = 5.0
# ... and it drops the upload 8 s after the last item it got [s].
UPLOAD_DEAD_S = 10.0
CANCELLED_RESTARTS = 3

ACK_WORDS = {
    value: entry.name.removeprefix("MAV_MISSION_").replace("_", " ").lower()
    for value, entry in wire.enums["MAV_MISSION_RESULT"].items()
}


@dataclass(frozen=True, slots=True, kw_only=True)
class ListResult:
    """How an upload ended; ``ack`` is the MISSION_ACK type, None when none came."""

    outcome: TransferOutcome
    text: str = ""
    ack: int | None = None


class ListUpload:
    """Offers items and serves requests until the autopilot acknowledges.

    Args:
        items: what each number is; contiguous from ``first``.
        first: number of the first item; with ``partial`` the others on the autopilot stay.
    """

    def __init__(
        self,
        party: Party,
        mission_type: MissionType,
        items: Sequence[MissionItem],
        *,
        first: int = 0,
        partial: bool = False,
    ) -> None:
        if partial and not items:
            raise ValueError("a partial write needs items")
        self.result: ListResult | None = None
        self._party, self._type, self._first, self._partial = party, mission_type, first, partial
        self._items: Mapping[int, MissionItem] = {first + i: item for i, item in enumerate(items)}
        self._retry = Retransmission(give_up_s=8.0)
        self._texts = Texts(party)
        self._sent: set[int] = set()
        self._heard_s = 0.0
        self._restarts = 0
        self._refusal: int | None = None
        self._wake_s = 0.0

    @property
    def wake_s(self) -> float:
        """When ``tick`` is due [s]."""
        return self._wake_s

    def start(self, t_s: float) -> list[Message]:
        """Offer the list."""
        self._sent.clear()
        self._heard_s = t_s
        self._retry.progress(t_s)
        self._wake_s = self._retry.wake_s
        return [self._offer()]

    def receive(self, t_s: float, message: Message) -> list[Message]:
        """Serve a request, or end on an acknowledgement."""
        self._texts.take(message)
        kind = message.get_type()
        if (
            kind not in {"MISSION_REQUEST", "MISSION_REQUEST_INT", "MISSION_ACK"}
            or not self._party.is_from_target(message)
            or not self._party.is_for_us(message)
            or message.mission_type != self._type
            or self.result is not None
            or self._refusal is not None
        ):
            return []
        if kind == "MISSION_ACK":
            return self._acknowledged(t_s, message.type)
        item = self._items.get(message.seq)
        if item is None:
            return []
        self._heard_s = t_s
        self._sent.add(message.seq)
        self._wake_s = t_s + (LAST_ACK_WAIT_S if len(self._sent) == len(self._items) else UPLOAD_DEAD_S)
        return [mission_item_int(self._party.target, message.seq, item, self._type)]

    def tick(self, t_s: float) -> list[Message]:
        """Offer again, or give up."""
        if self._refusal is not None:
            return self._end(TransferOutcome.REFUSED, self._reason(self._refusal), self._refusal)
        if self._sent:
            if len(self._sent) == len(self._items):
                return self._end(TransferOutcome.UNCONFIRMED, "all items sent, no final acknowledgement")
            return self._end(
                TransferOutcome.TIMEOUT,
                f"the autopilot stopped asking after {len(self._sent)} of {len(self._items)} items",
            )
        if not self._retry.again(t_s):
            return self._end(TransferOutcome.TIMEOUT, "no answer to the offer of a list")
        self._wake_s = self._retry.wake_s
        return [self._offer()]

    def _offer(self) -> Message:
        target, last = self._party.target, self._first + len(self._items) - 1
        if self._partial:
            return wire.MAVLink_mission_write_partial_list_message(*target, self._first, last, int(self._type))
        return wire.MAVLink_mission_count_message(*target, len(self._items), int(self._type))

    def _acknowledged(self, t_s: float, ack: int) -> list[Message]:
        if ack == wire.MAV_MISSION_ACCEPTED:
            if len(self._sent) < len(self._items):
                return []  # a late echo of an earlier upload
            return self._end(TransferOutcome.OK, "", ack)
        if ack == wire.MAV_MISSION_INVALID_SEQUENCE:
            return []  # the upload goes on as long as requests come
        if ack in {wire.MAV_MISSION_OPERATION_CANCELLED, wire.MAV_MISSION_DENIED} and (
            self._restarts < CANCELLED_RESTARTS
        ):
            # somebody else is uploading, or the autopilot lost patience: once more, a little later
            self._restarts += 1
            self._sent.clear()
            self._retry.progress(t_s)
            self._wake_s = t_s + 1.0
            return []
        self._refusal = ack
        self._wake_s = t_s + REASON_WAIT_S
        return []

    def _reason(self, ack: int) -> str:
        words = f"MISSION_ACK {ack} ({ACK_WORDS.get(ack, 'unknown')})"
        said = str(self._texts)
        return f"{words}: {said}" if said else words

    def _end(self, outcome: TransferOutcome, text: str, ack: int | None = None) -> list[Message]:
        self.result = ListResult(outcome=outcome, text=text, ack=ack)
        return []


@dataclass(frozen=True, slots=True, kw_only=True)
class DownloadResult:
    """How a download ended; ``items`` is complete when ``outcome`` is OK (for missions item 0 is home)."""

    outcome: TransferOutcome
    text: str = ""
    items: tuple[MissionItem, ...] = ()


class ListDownload:
    """Asks for the list, then for item after item."""

    def __init__(self, party: Party, mission_type: MissionType) -> None:
        self.result: DownloadResult | None = None
        self._party, self._type = party, mission_type
        self._retry = Retransmission()
        self._texts = Texts(party)
        self._count: int | None = None
        self._items: dict[int, MissionItem] = {}

    @property
    def wake_s(self) -> float:
        """When ``tick`` is due [s]."""
        return self._retry.wake_s

    def start(self, t_s: float) -> list[Message]:
        """Ask for the number of items."""
        self._retry.progress(t_s)
        return [self._question()]

    def receive(self, t_s: float, message: Message) -> list[Message]:
        """Take the count or an item."""
        self._texts.take(message)
        kind = message.get_type()
        if (
            kind not in {"MISSION_COUNT", "MISSION_ITEM_INT", "MISSION_ITEM", "MISSION_ACK"}
            or self.result is not None
            or not self._party.is_from_target(message)
            or not self._party.is_for_us(message)
            or message.mission_type != self._type
        ):
            return []
        if kind == "MISSION_ACK":
            # refusal of the list; ACKs of an upload before it (0, 13) are not about us
            if self._count is None and message.type not in {
                wire.MAV_MISSION_ACCEPTED,
                wire.MAV_MISSION_INVALID_SEQUENCE,
            }:
                words = f"MISSION_ACK {message.type} ({ACK_WORDS.get(message.type, 'unknown')}) {self._texts}"
                self.result = DownloadResult(outcome=TransferOutcome.REFUSED, text=words.strip())
            return []
        if kind == "MISSION_COUNT":
            if self._count == message.count:
                return []
            # a first count, or the list changed its length while it was read: from the beginning
            self._count, self._items = message.count, {}
        elif self._count is not None and message.seq == len(self._items) < self._count:
            try:
                self._items[message.seq] = mission_item(message)
            except ValueError as error:
                self.result = DownloadResult(outcome=TransferOutcome.MISMATCH, text=f"item {message.seq}: {error}")
                return []
        else:
            return []
        self._retry.progress(t_s)
        if len(self._items) == self._count:
            items = tuple(self._items[i] for i in range(self._count))
            self.result = DownloadResult(outcome=TransferOutcome.OK, items=items)
            return [wire.MAVLink_mission_ack_message(*self._party.target, 0, int(self._type))]
        return [self._question()]

    def tick(self, t_s: float) -> list[Message]:
        """Ask again, or give up."""
        if not self._retry.again(t_s):
            text = (
                "no answer to the request of a list"
                if self._count is None
                else (f"item {len(self._items)} of {self._count} never came")
            )
            self.result = DownloadResult(outcome=TransferOutcome.TIMEOUT, text=text)
            return []
        return [self._question()]

    def _question(self) -> Message:
        if self._count is None:
            return wire.MAVLink_mission_request_list_message(*self._party.target, int(self._type))
        return wire.MAVLink_mission_request_int_message(*self._party.target, len(self._items), int(self._type))
