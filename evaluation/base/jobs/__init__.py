"""Work split into jobs that run in parallel, on one machine or many."""
