"""Results as texts and tables of a terminal: shows, and computes nothing."""
