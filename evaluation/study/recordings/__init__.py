"""Finds recordings, sorts them by map and stage, and forms their pairs."""
