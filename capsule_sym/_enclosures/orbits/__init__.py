"""Proofs of periodic orbits: equations, tubes of solutions, stability, bifurcations."""
