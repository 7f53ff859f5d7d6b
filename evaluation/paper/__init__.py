"""The paper "The City that Never Settles", as reference for the cities.

`paper_values` contains the paper's numbers, and `findings` compares the shipped
cities with them. Commands pass their maps to `reference_for`; no other part of
the evaluation needs this package.
"""

from evaluation.paper.paper_reference import reference_for

__all__ = ["reference_for"]
