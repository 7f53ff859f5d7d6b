"""The ground of a city: streets, markings, terrain, bridges."""
