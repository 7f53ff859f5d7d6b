"""Experiments: fields of their files, factors, conditions; shipped files."""
