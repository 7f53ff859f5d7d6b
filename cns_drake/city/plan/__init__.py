"""The inputs of a city: its districts and its stages."""
