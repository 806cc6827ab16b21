"""Section 4: case study, thresholds, and data of figures."""
