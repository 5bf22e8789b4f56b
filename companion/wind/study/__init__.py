"""Recorded wind: records, scores of forecasts over them, and the constants fitted to them."""
