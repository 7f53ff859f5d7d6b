"""The whole benchmark as jobs, each of which leaves files.

`plan_study` says what is to be done, of recordings that need not exist yet;
`evaluation.jobs` does it, on one machine or many; `assemble` makes tables,
figures and a page of what the jobs left. Nothing that was done is done again:
each file states what it was made of.
"""

from evaluation.study.assembly import assemble
from evaluation.study.chosen_methods import MethodChoice, choose_methods
from evaluation.study.plan import plan_study

__all__ = ["MethodChoice", "assemble", "choose_methods", "plan_study"]
