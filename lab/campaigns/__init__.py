"""Campaigns: many voyages, drawn by seed and judged."""
