"""Periodic orbits of the map: their equations, their stability, continuation and performance."""
