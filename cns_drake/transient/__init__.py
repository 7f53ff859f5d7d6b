"""Temporary changes between drives: parked cars, leaves, snow, roadworks.

A loaded world is changed before it becomes part of a diagram.
"""
