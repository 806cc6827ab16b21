"""The theory: model, closed forms, geometry and switching, derived and proved with SymPy."""
