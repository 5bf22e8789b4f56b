"""The doctor: is this autopilot set up to be sailed, and what to set instead.

Pure: parameters, version, lists and message rates in, findings out. ``companion doctor`` reads them from an
autopilot, prints the findings, and sets parameters only when told to. Names are ArduPilot's; where 4.7 renamed a
parameter both names are understood. SIM_ parameters are never looked at.
"""

from companion.doctor.examination import examine
from companion.doctor.report import DoctorFinding, Examined, Level, Needs
from companion.doctor.steering import examine_steering
from companion.doctor.vehicle import RATES_HZ

__all__ = ["RATES_HZ", "DoctorFinding", "Examined", "Level", "Needs", "examine", "examine_steering"]
