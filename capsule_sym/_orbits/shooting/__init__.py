"""Periodic orbits of an itinerary: equations, Newton's method, admissibility, stability."""
