"""Families of orbits in their parameters, continued step by step from itinerary to itinerary."""
