"""What a study measures on two drives: one class and one module per task.

A `task.Task` takes a `pair.Pair` of drives, adds the jobs that measure it to
`jobs.Jobs`, and turns their results into the numbers of a table.
"""
