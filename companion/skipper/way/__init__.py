"""The way: the voyage's goals and gates, legs and points, what a path is worth in a wind. Values and geometry."""
