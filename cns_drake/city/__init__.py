"""The city generator: road networks, streets, structures, stages, SDF."""
