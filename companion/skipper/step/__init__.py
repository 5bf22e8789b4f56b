"""One step: what the skipper sees, remembers, may do and asks for, and the step in the making."""
