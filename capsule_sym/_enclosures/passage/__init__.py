"""The passage of a motion from switch to switch, with each switch proved to be the first event."""
