"""The engine of studies, and the whole benchmark as jobs that write files.

A study is pairs of drives x tasks x methods: `engine.Engine` measures pairs of
drives by the tasks in `tasks`, and writes `results.csv` and `queries.csv`.
`plan.Study` lists the jobs of a report; the recordings need not exist yet.
`cns_drake.base.jobs` runs jobs, on one machine or many. No finished job runs
again, because each file names the inputs from which it was made. This module
imports nothing, because each job starts a process.
"""
