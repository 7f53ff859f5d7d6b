"""The common tables of all results, with summaries, charts and rankings.

`table` reads and writes `results.csv` and `queries.csv`, `summaries` computes
numbers from them, `charts` and `page` show them, and `comparing` ranks methods
together with the shipped tables in `baselines`.
"""
