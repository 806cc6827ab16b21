"""Orbits in one parameter, bifurcations in two, and their records."""
