"""Finds an experiment's maps, and makes aged, redrawn and imported maps."""
