"""Changes between drives: parked cars, leaves, snow, roadworks, low roofs.

The changes are made in a loaded world, before it becomes part of a diagram.
"""
