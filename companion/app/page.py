"""The live page of a voyage: every step is shown, orders of the page come in as those of the socket on board."""

from __future__ import annotations

import asyncio
from collections.abc import Sequence
from typing import Any

import numpy as np

from companion.app.crew import Crew
from companion.app.executor import Planner
from companion.app.showing import Showing
from companion.fold import Step, VoyageFold
from companion.orders import LOCAL, Answer, Verb, Wanted, permitted
from companion.page import Address, Chart, Live, plan_figures, served
from companion.planner import Plan
from companion.view import Event, View

# All browsers are one station: an order that is sent twice in haste is done once. No connection of the socket on
# board has this number.
BROWSERS = 1_000_000
PREVIEW_S = 0.5        # for a plan that is only looked at: the boat's own may have to wait for it so long
LAST_S = 5.0           # for one that is being made when the voyage ends


class LivePage:
    """Shows the steps of a voyage on ``live``."""

    def __init__(self, live: Live, showing: Showing, fold: VoyageFold, planner: Planner, crew: Crew) -> None:
        self._live, self._showing, self._fold, self._planner, self._crew = live, showing, fold, planner, crew
        self._step: Step | None = None
        self._plan: asyncio.Task[Plan] | None = None

    def show(self, view: View, events: tuple[Event, ...], step: Step) -> None:
        """Show a step."""
        self._step = step
        self._live.show(view, events, self._showing.area)

    async def ask(self, wanted: Wanted) -> Answer:
        """Give an order."""
        return await self._crew.ask(wanted, BROWSERS, LOCAL)

    async def preview(self, wanted: Wanted) -> dict[str, Any]:
        """Return the plan that an order would lead to; ``error`` says why there is none."""
        step = self._step
        if step is None:
            return {"error": "nothing is known of the boat yet"}
        asked = self._fold.skipper.preview(step.state, step.snapshot, wanted)
        if isinstance(asked, str):
            return {"error": asked}
        if step.state.pending_plan is not None or (self._plan is not None and not self._plan.done()):
            return {"error": "a plan is being made: again in a moment"}
        # A task of its own: who hangs up must not end the planner's work, which would end the planner.
        self._plan = asyncio.create_task(
            self._planner.plan(asked.problem, budget_s=PREVIEW_S, seed=asked.seed, algorithm=asked.planner.algorithm,
                               settings=asked.planner.settings), name="preview")
        return {"order": wanted.words, **_in_figures(await asyncio.shield(self._plan))}

    async def end(self) -> None:
        """Wait for a plan that is being made."""
        if self._plan is not None and not self._plan.done():
            await asyncio.wait({self._plan}, timeout=LAST_S)
            self._plan.cancel()
            await asyncio.gather(self._plan, return_exceptions=True)


def _in_figures(plan: Plan) -> dict[str, Any]:
    if not plan.has_path:
        return {"error": f"no way there was found: {plan.reason}"}
    return {"error": None, "way_en_m": np.round(plan.waypoints_en, 1).tolist(), **plan_figures(plan)}


async def live_page(
    address: Address, fold: VoyageFold, planner: Planner, crew: Crew, showing: Showing, *, pace: float,
    charts: Sequence[Chart],
) -> None:
    """Serve the page of a voyage until cancelled. ``pace``: seconds of the loop for each second.

    Raises:
        JobError: it cannot be served there.
        Exception: a step could not be shown.
    """
    verbs = fold.permissions.local_orders
    live = Live(name=fold.skipper.voyage.name, unix_s=showing.epoch_s, area=showing.area,
                permitted=tuple(verb.value for verb in Verb if permitted(verb, verbs)))
    page = LivePage(live, showing, fold, planner, crew)
    if address.token:
        live.ask, live.preview = page.ask, page.preview
    failed: asyncio.Future[None] = asyncio.get_running_loop().create_future()

    def show(view: View, events: tuple[Event, ...], step: Step) -> None:
        try:
            page.show(view, events, step)
        except Exception as error:   # a new page may do better
            if not failed.done():
                failed.set_exception(error)

    async with served(address, live, pace=pace, charts=charts):
        showing.watchers.append(show)
        try:
            await failed
        finally:
            showing.watchers.remove(show)
            await page.end()
