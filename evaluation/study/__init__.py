"""The whole benchmark as jobs, each of which leaves files.

`plan.Study` lists the jobs; the recordings need not exist yet.
`cns_drake.base.jobs` runs them, on one machine or many. The study then
makes tables, figures and a page of their files. No finished job runs again:
each file states its inputs. This module imports nothing, because each job
starts a process.
"""
