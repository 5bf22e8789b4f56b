"""Results held against each other: two tables of a campaign, paired by seed, and whether one is worse."""

from sitl.results.compare import Change, Comparison, compare
from sitl.results.told import told, told_table

__all__ = ["Change", "Comparison", "compare", "told", "told_table"]
