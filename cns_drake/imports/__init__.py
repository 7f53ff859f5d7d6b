"""Imports: makes maps with drives from real cities and road networks."""
