"""The doctor: is this autopilot set up to be sailed, and what to set instead."""
