"""Proofs in ball arithmetic: enclosures of orbits, bifurcations and runs; certificates."""
