"""Conversations with the autopilot as pure step machines: commands, lists, parameters, files."""
