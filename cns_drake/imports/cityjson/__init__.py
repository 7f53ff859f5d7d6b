"""Imports cities from CityJSON and CityJSONSeq files."""
