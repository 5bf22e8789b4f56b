"""The planning problem: the value, its JSON, what is wrong with it, and the exact scorer of paths."""
