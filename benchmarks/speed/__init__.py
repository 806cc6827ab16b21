"""The study of speed with what only developers ask for: goals, growth, tangencies, first calls."""
