"""What ``auto`` is made of: proposals, lattices, the metric's geodesics, annealing, bounds."""
