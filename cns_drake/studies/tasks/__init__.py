"""What a study asks of two drives: each task is a class in a file of its own.

A task adds the jobs that measure a pair of drives, and turns what they find
into the numbers of a table.
"""
