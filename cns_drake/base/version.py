"""The version of the release, which recordings and reports carry."""

__version__ = "1.0.0"
