"""Numbers that enclose: balls, polynomial forms over a patch, and the flow of a field."""
