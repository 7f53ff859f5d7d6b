"""Vehicles and walkers that move while a drive is recorded.

They are planned once, before the drive, as a function of roads and seed. During
the drive their poses are looked up by time.
"""
