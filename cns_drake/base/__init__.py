"""Code that simulator and evaluation have in common: errors, files, jobs."""
