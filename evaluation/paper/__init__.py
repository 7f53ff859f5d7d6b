"""The paper "The City that Never Settles", as reference for the cities.

This package contains the paper's values, pairs of drives and claims, and
compares the shipped cities with these values. Commands pass their maps to
`reference_for`; no other part of the evaluation needs this package.
"""

from evaluation.paper.paper_reference import reference_for

__all__ = ["reference_for"]
