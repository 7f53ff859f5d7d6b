"""Adds details to the plain shapes of an imported city.

Details follow from tags in the file. Details without a tag are random.
"""
