"""The paper "The City that Never Settles", as reference for the cities.

This package contains the paper's values, pairs of drives and claims, and
compares the shipped cities with them. Commands pass their maps to
`reference_for`; the rest of the evaluation does not need this package.
"""

from evaluation.paper.paper_reference import reference_for

__all__ = ["reference_for"]
