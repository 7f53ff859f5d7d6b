"""Writes the stages of a city as SDF from a folder of YAML files."""
