"""The crew on the link: what is an order, what is sent away, and that without the key nothing counts."""

import asyncio

from pymavlink.dialects.v20 import ardupilotmega as wire

from companion.app.local_clients import BROWSERS, MOST_WAITING, OperatorCommands
from companion.mavlink.autopilot import Autopilot
from companion.mavlink.wire.frames import Codec, Drop, SigningState
from companion.orders import Result, Verb, Wanted
from companion.skipper.step import Acknowledge
from tests.mavlink.test_link import store, with_peer


def command(verb, number=wire.MAV_CMD_USER_1, component=191):
    return wire.MAVLink_command_long_message(1, component, number, 0, verb, 0, 0, 0, 0, 0, 0)


def test_orders_wait_for_the_step_and_the_rest_is_sent_away():
    async def main(peer, link):
        await link.wait_autopilot(5.0)
        operator, station = OperatorCommands(link, has_key=False), Codec(255, 190)

        async def give(*messages):
            for message in messages:
                peer.end.write(station.pack(message))
            await asyncio.sleep(0.1)
            return [(a.command, a.result) for a in peer.of("COMMAND_ACK")]

        assert await give(command(1)) == [(31010, 1)], "not now: nobody would answer it yet"
        operator.begin()
        assert len(await give(command(1), command(2))) == 1
        orders = operator.take()
        assert [o.wanted.verb for o in orders] == [Verb.HOLD, Verb.GO_ON]
        assert {(o.source.words, o.authority) for o in orders} == {("the ground station", "unsigned")}
        assert operator.take() == []
        assert (await give(command(1, number=wire.MAV_CMD_DO_SET_MODE)))[1:] == [(176, 3)]
        await give(command(1, component=190), command(1, component=0), command(1, component=1))
        assert operator.take() == []
        acks = await give(*[command(float(n)) for n in range(1, MOST_WAITING + 3)])
        assert acks[2:] == [(31010, 1)] * 2
        assert len(operator.take()) == MOST_WAITING

    with_peer(main)


def test_with_a_key_what_is_not_signed_with_it_is_counted_and_said_once(tmp_path):
    ours = store(tmp_path)

    async def main(peer, link):
        await link.wait_autopilot(5.0)
        operator = OperatorCommands(link, has_key=True)
        operator.begin()
        good = SigningState(key=ours.state.key, timestamp=ours.state.timestamp + 1_000_000)
        for signing in (None, SigningState(key=bytes(32), timestamp=good.timestamp)):
            stranger = Codec(255, 190, signing)
            peer.end.write(stranger.pack(command(8)))
            peer.end.write(stranger.pack(command(8, component=1)))  # the autopilot's to judge
        await asyncio.sleep(0.1)
        assert operator.take() == []
        assert (operator.unsigned, peer.of("COMMAND_ACK")) == (2, [])
        assert (link.dropped()[Drop.BAD_SIGNATURE], link.dropped()[Drop.UNSIGNED]) == (2, 2)
        async with Autopilot(link) as autopilot:
            told = []
            await operator.watch(autopilot, told.append)
            assert ["without this boat's key" in record["text"] for record in told] == [True]
        peer.end.write(Codec(255, 190, good).pack(command(8)))
        await asyncio.sleep(0.1)
        assert [(o.wanted.verb, o.authority) for o in operator.take()] == [(Verb.STOP, "signed")]

    with_peer(main, peer_signing=SigningState(key=ours.state.key, timestamp=ours.state.timestamp), signing=ours)


def test_an_answer_is_that_of_the_order_and_not_of_one_that_nobody_waits_for_any_more():
    """All browsers are one station: after an order that was not answered in time the next was told its answer."""

    async def main(_peer, link):
        operator = OperatorCommands(link, has_key=False)
        operator.begin()

        def ask(verb):
            return asyncio.create_task(operator.ask(Wanted(verb=verb), BROWSERS))

        late = ask(Verb.HOLD)
        await asyncio.sleep(0.0)
        late.cancel()
        first, second = ask(Verb.GO_ON), ask(Verb.STOP)
        await asyncio.sleep(0.0)
        for order in operator.take():
            source, verb = order.source, order.wanted.verb
            operator.answered(
                Acknowledge(
                    way=source.kind,
                    system=source.system,
                    component=source.component,
                    command=order.command,
                    result=Result.DONE if verb is Verb.HOLD else Result.REFUSED,
                    text=verb.value,
                )
            )
        answers = [await asyncio.wait_for(each, 5.0) for each in (first, second)]
        assert [(a.result, a.text) for a in answers] == [(Result.REFUSED, "go_on"), (Result.REFUSED, "stop")]

    with_peer(main)
