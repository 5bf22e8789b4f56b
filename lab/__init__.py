"""The laboratory: what research runs on the companion and its simulator, beside what a boat carries."""
