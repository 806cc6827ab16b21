"""The case study of Section 4: motions, thresholds, and the data of figures."""
