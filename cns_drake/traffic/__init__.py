"""Vehicles and pedestrians (walkers) that move while a drive is recorded.

Their motion is planned before the drive, from the roads and a seed. During the
drive, their poses are interpolated in this plan.
"""
