"""Optima and fronts beside brute force."""
