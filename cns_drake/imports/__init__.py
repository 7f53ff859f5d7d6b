"""Imports real cities and road networks as maps with drives."""
