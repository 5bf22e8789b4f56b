"""Recorded wind: records, scores of forecasts over them, and the constants fitted to them."""

from companion.wind.study.ar1 import Ar1Fit, fit_ar1
from companion.wind.study.characterisation import Cell, Characterisation, characterise, runs
from companion.wind.study.records import Record, parse_csv
from companion.wind.study.score import SCORED_LEVELS, HorizonScore, Score, average, score

__all__ = [
    "SCORED_LEVELS", "Ar1Fit", "Cell", "Characterisation", "HorizonScore", "Record", "Score", "average", "characterise",
    "fit_ar1", "parse_csv", "runs", "score",
]
