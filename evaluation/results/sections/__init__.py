"""Sections of the page of a study on recordings, a module for each section.

`charts`, results, conditions and files are sections of every study's page; they
are in `evaluation.results.page`.
"""
