"""Proofs in ball arithmetic: orbits, bifurcations, branches and trajectories, enclosed."""
