"""Helpers that reach behind the doors of packages, to replace parts of them."""
