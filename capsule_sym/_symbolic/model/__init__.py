"""The model and what is derived from it: closed forms, geometry and switching."""
