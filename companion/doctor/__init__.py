"""The doctor: is this autopilot set up to be sailed, and what to set instead."""

from companion.doctor.checks import examine
from companion.doctor.findings import Examined, Finding, Level, Needs
from companion.doctor.safety import RATES_HZ

__all__ = ["RATES_HZ", "Examined", "Finding", "Level", "Needs", "examine"]
