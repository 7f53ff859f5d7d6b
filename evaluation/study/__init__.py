"""A study, which measures pairs of drives: a public noun.

An `Experiment` has conditions. A `Study` measures pairs of drives under these
conditions, by tasks and methods, and writes `results.csv` and `queries.csv`.
`study_recordings` is the experiment `stages` on recordings. Nothing is measured
twice, because a store names each result by what it was made of.

This module imports nothing, because the process of each job would have to wait
for the imports.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
