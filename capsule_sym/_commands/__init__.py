"""The commands: each parses its options, calls one package and presents the result."""
