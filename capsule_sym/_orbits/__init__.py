"""Periodic orbits of the map: their equations, their stability, and what they are worth."""
