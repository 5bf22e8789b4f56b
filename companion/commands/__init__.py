"""The companion's commands, one module each."""
