"""Design of devices: sensitivities, fits, optima, fronts, steering and tolerances."""
