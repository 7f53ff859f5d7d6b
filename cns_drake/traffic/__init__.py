"""Vehicles and pedestrians that move while a drive is recorded.

The motion of these road users is planned before the drive, from the roads and a
seed. During the drive, the poses are interpolated from this plan.
"""
