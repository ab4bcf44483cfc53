"""Studies with planners: the paper's claims, the smoothness weight, the estimated numbers, the calculation time."""
