"""Code that simulator and evaluation share: errors, files, jobs, formats."""
