"""Cameras: their description, the scene that they see, and their systems."""
