"""What comes and goes between drives: parked cars, leaves, snow, roadworks.

A world that is loaded is changed before it becomes a part of a diagram.
"""
