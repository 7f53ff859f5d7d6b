"""Imports: real cities and road networks become maps with drives."""
