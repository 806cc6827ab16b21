"""Other tools on the same task, each as its documentation advises."""
