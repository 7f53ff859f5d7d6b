"""Adds details to the plain shapes of an imported city.

The details follow from tags in the file and are otherwise random.
"""
