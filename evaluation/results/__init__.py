"""The common tables of all results, with summaries, charts and rankings.

- `table` contains `results.csv` and `queries.csv`. Their rows begin with a key
  of `keys`; `table_lines` reads their lines.
- `summaries` and `ranking` compute numbers from these tables.
  `compared_answers` compares methods by their answers, `headlines` says in
  words which methods differ and survive, and `ranges` contains the possible
  values of each metric.
- `charts` and `page` show tables as charts and pages.
- `table_comparison` compares tables with one another, and with the shipped
  tables in `baselines`.
"""

from cns_drake.base import attach

__getattr__, __dir__, __all__ = attach(__name__, __file__)
