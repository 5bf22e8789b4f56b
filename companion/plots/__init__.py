"""Pictures of plans, winds and voyages."""
