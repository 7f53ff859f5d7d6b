"""The whole benchmark as jobs, each of which writes files.

`plan.Study` lists the jobs; the recordings need not exist yet.
`cns_drake.base.jobs` runs them, on one machine or many. The study then makes
tables, figures and a page from the files of the jobs. No finished job runs
again, because each file names the inputs from which it was made. This module
imports nothing, because each job starts a process.
"""
