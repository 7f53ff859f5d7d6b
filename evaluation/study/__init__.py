"""Measures studies by jobs that write files.

A study measures pairs of drives by several tasks and methods: `engine.Engine`
measures the pairs by the tasks in `tasks`, and writes `results.csv` and
`queries.csv`. `recorded_study` is the experiment `stages` on recordings, which
need not exist yet; `recordings` finds them. `cns_drake.base.jobs` runs
jobs, on one machine or many. No finished job runs again, because each file in
`storage` names the inputs from which it was made. This module imports nothing,
because the process of each job would have to wait for the imports.
"""

from cns_drake.base import attach

__getattr__, __dir__, __all__ = attach(__name__, __file__)
