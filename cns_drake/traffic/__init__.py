"""Vehicles and walkers that move while a drive is recorded.

They are planned once, before the drive, as a function of roads and seed; then
they are looked up at a time.
"""
