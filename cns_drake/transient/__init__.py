"""Changes between drives: parked cars, leaves, snow, roadworks, height limits.

The changes are made in a loaded world, before it becomes part of a diagram.
"""
