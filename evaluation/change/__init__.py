"""Structural change between two drives or maps."""
