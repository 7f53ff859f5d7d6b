"""Localisation of single scans, or of a drive, in a map."""
