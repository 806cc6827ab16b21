"""Curves of bifurcations in two parameters, and those that leave their points."""
