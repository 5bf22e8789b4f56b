"""Recorded wind: records, scores of forecasts over them, and what an AR(1) fits to them."""

from companion.wind.study.records import Ar1Fit, Record, fit_ar1, parse_csv
from companion.wind.study.score import (
    FEWEST,
    SCORED_HORIZONS_S,
    SCORED_LEVELS,
    Characterisation,
    HorizonScore,
    Score,
    asked_rows,
    average,
    characterise,
    runs,
    score,
    targets,
)

__all__ = [
    "FEWEST",
    "SCORED_HORIZONS_S",
    "SCORED_LEVELS",
    "Ar1Fit",
    "Characterisation",
    "HorizonScore",
    "Record",
    "Score",
    "asked_rows",
    "average",
    "characterise",
    "fit_ar1",
    "parse_csv",
    "runs",
    "score",
    "targets",
]
