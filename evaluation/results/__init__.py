"""The common tables of all results, with summaries, charts and rankings.

`table` reads and writes `results.csv` and `queries.csv`, `summaries` computes
numbers from these tables, `charts` and `page` show the tables, and `comparing`
ranks methods together with the shipped tables in `baselines`.
"""
