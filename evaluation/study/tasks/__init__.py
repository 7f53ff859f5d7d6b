"""What a study measures on two drives: one class and one module per task.

A `task.Task` takes a `pair.Pair` of drives, adds the jobs that measure this
pair to `jobs.Jobs`, and turns the results of these jobs into the numbers of a
table.
"""
