"""Hard cases of the search for switches: what is true, what the map finds, what others find."""
