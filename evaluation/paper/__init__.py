"""The paper "The City that Never Settles" beside the cities made after it.

It has the paper's values, pairs of drives and claims, and judges the shipped
cities by them. Commands pass their maps to `reference_for`; the rest of the
evaluation does not need this package.
"""

from evaluation.paper.paper_reference import reference_for

__all__ = ["reference_for"]
