"""Paper 1: Bayesian optimisation finds the motions that open an unknown door."""
