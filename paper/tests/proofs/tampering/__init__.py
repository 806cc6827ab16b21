"""Tampered certificates, put to both checkers."""
