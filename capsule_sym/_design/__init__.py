"""From the map to the device: how motions depend on parameters, and which parameters are best."""
