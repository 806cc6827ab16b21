"""The case study of Section 4: motions, thresholds, and the data that figures draw."""
