"""What a study measures on two drives: one class and one file per task.

A task adds the jobs that measure a pair of drives, and turns their results into
the numbers of a table.
"""
