"""The city generator: writes a city as SDF from roads, a plan and stages."""
