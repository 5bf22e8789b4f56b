"""Competition tasks: scenarios that run in a fast closed loop, and scorers that are pure functions of a track."""
