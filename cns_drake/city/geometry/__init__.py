"""Meshes, polygons and the structures that are made of them."""
