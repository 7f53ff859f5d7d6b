"""Chooses the places of all structures of a city."""
