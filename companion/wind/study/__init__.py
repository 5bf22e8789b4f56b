"""Recorded wind: records, scores of forecasts over them, and the constants fitted to them."""

from companion.wind.study.records import Ar1Fit, Record, fit_ar1, parse_csv
from companion.wind.study.score import (
    SCORED_LEVELS,
    Characterisation,
    FilterScore,
    HorizonScore,
    Score,
    average,
    characterise,
    runs,
    score,
)

__all__ = [
    "SCORED_LEVELS", "Ar1Fit", "Characterisation", "FilterScore", "HorizonScore", "Record", "Score", "average",
    "characterise", "fit_ar1", "parse_csv", "runs", "score",
]
