"""Many runs of the map as one labelled, resumable result, on one core or a cluster."""
