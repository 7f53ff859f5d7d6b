"""Decides what stands where."""
