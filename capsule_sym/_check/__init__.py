"""Switches of any integrator, compared with those of the exact map."""
