"""SDF worlds, their structures, and the geometry that sensors see."""
