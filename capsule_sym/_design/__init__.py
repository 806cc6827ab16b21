"""Design of devices: sensitivities, fits, optima, fronts and tolerances."""
