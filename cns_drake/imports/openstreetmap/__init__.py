"""Imports buildings, streets and land from OpenStreetMap files."""
