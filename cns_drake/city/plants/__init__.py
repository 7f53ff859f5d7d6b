"""The trees of a city."""
