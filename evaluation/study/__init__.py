"""The whole benchmark as jobs, each of which leaves files.

`plan.plan_study` lists the jobs; the recordings need not exist yet.
`cns_drake.base.jobs` runs them, on one machine or many. `assembly.assemble`
makes tables, figures and a page of their files. No finished job runs again:
each file states its inputs. This module imports nothing, because each job
starts a process.
"""
