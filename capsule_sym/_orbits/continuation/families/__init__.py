"""Families of orbits in their parameters, followed step by step from itinerary to itinerary."""
