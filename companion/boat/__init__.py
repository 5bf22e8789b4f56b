"""boat."""
