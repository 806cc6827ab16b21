"""The model and its derivations: closed forms, geometry and switching."""
