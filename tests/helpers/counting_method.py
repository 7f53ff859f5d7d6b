"""A method of a user, which counts points."""

COUNTING = """
import numpy as np
from evaluation import Method, MethodConfig, register

@register("counting")
class Counting(Method):
    class Config(MethodConfig):
        unit: float = 1.0

    def describe(self, points):
        return len(points)

    def build_database(self, places):
        return np.array(places)

    def score(self, query, database, *, exhaustive=False):
        return -np.abs(database - query) / 1e6
"""
