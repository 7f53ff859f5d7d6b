"""The city generator: makes a city in SDF from roads, a plan and stages."""
