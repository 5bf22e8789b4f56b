"""skipper."""
