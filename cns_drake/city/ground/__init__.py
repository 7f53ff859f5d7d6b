"""What a city stands on: streets, markings, terrain, bridges."""
