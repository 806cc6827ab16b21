"""Bifurcation points: their types, conditions, equations, records and normal forms."""
