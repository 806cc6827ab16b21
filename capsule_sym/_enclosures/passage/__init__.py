"""Passage of a motion from switch to switch; each switch is proved to be the first event."""
