"""Pictures of trajectories, orbits and branches, and of the whole case study; they draw only."""
