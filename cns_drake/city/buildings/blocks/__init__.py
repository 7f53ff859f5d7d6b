"""Blocks of flats and offices that stand wall to wall."""
