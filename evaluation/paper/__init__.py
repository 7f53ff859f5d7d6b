"""The paper "The City that Never Settles" beside the cities made after it.

Its values, which drives ask which, its claims, and how near the shipped cities
come to it. Commands hand `reference_for` their maps; nothing else of the
evaluation needs this package.
"""

from evaluation.paper.paper_reference import reference_for

__all__ = ["reference_for"]
