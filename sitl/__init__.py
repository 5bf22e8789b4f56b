"""The proving ground: a simulated autopilot, weather, scenarios and campaigns."""
