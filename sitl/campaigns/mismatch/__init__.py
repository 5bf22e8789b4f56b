"""A boat that is not the plan's: what is drawn for it, the voyages, what was promised and what came of it."""
