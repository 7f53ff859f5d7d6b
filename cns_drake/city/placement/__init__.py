"""Chooses the places of all structures."""
