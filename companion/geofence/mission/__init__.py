"""A mission: goals, area and options, read from TOML, made from drawings, checked before anything believes it."""
