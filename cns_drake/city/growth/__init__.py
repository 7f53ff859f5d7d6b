"""Younger cities: buildings that are still lower, and lots in other use."""
