"""Many runs of the map as one labelled, resumable result, by threads."""
