"""The tables of a report, a module for each subject.

Functions named `..._table` return tables for print; functions named
`..._numbers` return tables with all digits, for files.
"""
