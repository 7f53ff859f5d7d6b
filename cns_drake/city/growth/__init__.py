"""Younger cities: buildings that are lower yet, and lots in other use."""
