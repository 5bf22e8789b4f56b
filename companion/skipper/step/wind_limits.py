"""The boat's limits of wind as chance constraints: how likely the forecast is to break one within the plan's time.

At each instant ``delta_s`` is promised, as of the no-go zone: so a limit is broken where the wind is beyond it with
more than ``1 - delta_s`` at the worst instant from now until nine of ten winds have brought it there. Before setting
sail that is a reason to wait; under way ``[safety] strong_wind`` and ``light_wind`` say what is done.
"""

from __future__ import annotations

import numpy as np

from companion.geo.distinct import distinct
from companion.messages import WindForecast
from companion.planner.problem import ASSUMED_SHARE, Strength
from companion.skipper.step.context import StepContext
from companion.skipper.step.snapshot import WindHealth

LEAST_S = 60.0  # ahead, however near the end of the plan is
AHEAD_S = 600.0  # while there is no plan
LEAST_SHARE = 0.03  # of the mean strength: what a cup anemometer errs by


def strength_of(forecast: WindForecast, *, after_s: float = 0.0, is_known: bool = True) -> Strength:
    """Return how strong the wind will be, from ``after_s`` of the forecast on.

    Never surer than an anemometer is (``LEAST_SHARE``); where the wind is not believed (``is_known``), no surer than
    one of which only the mean is known.
    """
    times = distinct(np.concatenate([[0.0], np.clip(forecast.horizon_s - after_s, 0.0, None)]))
    mean = np.interp(after_s + times, forecast.horizon_s, forecast.mean_tws_mps)
    sigma = np.interp(after_s + times, forecast.horizon_s, forecast.sigma_tws_mps)
    least = (LEAST_SHARE if is_known else ASSUMED_SHARE) * mean
    return Strength(
        horizon_s=tuple(times.tolist()),
        mean_mps=tuple(mean.tolist()),
        sigma_mps=tuple(np.maximum(sigma, least).tolist()),
        correlation_s=forecast.correlation_time_s,
        is_known=is_known,
    )


def too_strong(ctx: StepContext) -> float | None:
    """Return the chance of more wind than the boat's limit, as a multiple of what is allowed; None: no limit."""
    return _share(ctx, _strong(ctx))


def too_light(ctx: StepContext) -> float | None:
    """Return the same of less wind than the boat makes way in."""
    return _share(ctx, _light(ctx))


def winds_wanted(ctx: StepContext) -> list[str]:
    """Return what the boat waits for before setting sail, in words; empty: the wind will do."""
    boat, allowed, out = ctx.voyage.boat, _allowed(ctx), []
    for chance, name, limit in (
        (_strong(ctx), "less wind: above", boat.max_tws_mps),
        (_light(ctx), "more wind: below", boat.min_tws_mps),
    ):
        if chance is not None and chance > allowed:
            out.append(
                f"{name} {limit:g} m/s with {100.0 * chance:.0f} % within {_until_s(ctx):.0f} s, "
                f"{100.0 * allowed:.0f} % is allowed"
            )
    return out


def _strong(ctx: StepContext) -> float | None:
    limit = ctx.voyage.boat.max_tws_mps
    strength = None if limit is None else _strength(ctx)
    return None if limit is None or strength is None else strength.over(limit, _until_s(ctx))


def _light(ctx: StepContext) -> float | None:
    limit = ctx.voyage.boat.min_tws_mps
    strength = None if limit is None else _strength(ctx)
    return None if limit is None or strength is None else strength.under(limit, _until_s(ctx))


def _share(ctx: StepContext, chance: float | None) -> float | None:
    return None if chance is None else chance / _allowed(ctx)


def _strength(ctx: StepContext) -> Strength | None:
    forecast = ctx.snapshot.wind.forecast
    if forecast is None or not ctx.config.sails:
        return None
    return strength_of(forecast, is_known=ctx.snapshot.wind.health is not WindHealth.UNTRUSTED)


def _until_s(ctx: StepContext) -> float:
    """Return how far ahead is looked: the rest of the plan."""
    route = ctx.state.mission.route
    whole_s = None if route is None else route.late_s or route.cost_s
    if route is None or whole_s is None:
        return AHEAD_S
    began_s = route.plan_t_s if ctx.state.voyage.sailing else ctx.t_s
    return max(LEAST_S, began_s + whole_s - ctx.t_s)


def _allowed(ctx: StepContext) -> float:
    return 1.0 - ctx.config.delta_s
