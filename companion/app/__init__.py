"""The running program: one task group, what it was told, and the orders that it carries out."""
