"""The paper "The City that Never Settles", as reference for the cities.

`paper_values` contains the paper's numbers. `findings` and `aims` compare the
shipped cities with them, `best_methods` says which methods are best. Commands
pass their maps to `reference_for`; no other part of the evaluation needs this
package.
"""

from evaluation.paper.paper_reference import reference_for

__all__ = ["reference_for"]
