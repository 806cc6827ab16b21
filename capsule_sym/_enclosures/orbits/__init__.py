"""Periodic orbits proved: their equations, tubes of solutions, bifurcations, branches."""
