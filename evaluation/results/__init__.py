"""One table of everything that is measured, and what is made of it.

`table` reads and writes `results.csv` and `queries.csv`, `summaries` has the
numbers that are functions of them, `charts` and `page` show them, and
`comparing` ranks methods beside the tables in `baselines`.
"""
