"""Structural change and place recognition on LiDAR sequences.

Independent of the simulator: nothing in here imports Drake.
"""
