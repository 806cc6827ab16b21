"""Tests of the paper's house."""
