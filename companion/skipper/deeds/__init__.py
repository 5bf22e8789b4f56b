"""Deeds: getting under way, steering, loitering, stopping, and taking the helm again."""
