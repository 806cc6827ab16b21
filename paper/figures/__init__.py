"""Figures of the paper, and the report."""
