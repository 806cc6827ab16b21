"""Branches of orbits in one parameter, and those that leave them."""
