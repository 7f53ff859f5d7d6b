"""The whole benchmark as jobs, each of which leaves files.

`plan.plan_study` says what is to be done, of recordings that need not exist
yet; `cns_drake.base.jobs` does it, on one machine or many; `assembly.assemble`
makes tables, figures and a page of what the jobs left. Nothing that was done
is done again: each file states what it was made of.

Nothing is imported here, since each job has a process to start.
"""
