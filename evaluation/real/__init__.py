"""Public real scans, measured as a study measures them: a wall.

Data sets of few scans have rules of their own, which no other package knows. A
classifier judges whether simulated scans can be told from real scans.
"""

from cns_drake.base import attach

__getattr__, __dir__, __all__ = attach(__name__, __file__)
