"""The tasks of a study that need the simulator: `map` and `seen`."""
