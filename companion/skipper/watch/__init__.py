"""The watch: what can go wrong, how it is seen, and what is said of it."""
