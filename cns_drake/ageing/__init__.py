"""Ageing of cities year by year, at the rates of change of real cities.

- Today: `old_world` reads the city; `lots` and `plots` are the building land.
- A year: `ageing_city` simulates a year with `buildings`, `trees` and
  `street_renewal`. Events happen at the `rates`, with random numbers of
  `yearly_draws`; `standing_structures` says what stands. `new_buildings`,
  `alterations` and `sections` make what is new; `kinds` says which structures
  change.
- The past: `past_city`.
- A map: `aged_map`, `stage_writer`, `aged_pictures`; `events`, `years`.
"""

from cns_drake.base import attach

__getattr__, __dir__, __all__ = attach(__name__, __file__)
