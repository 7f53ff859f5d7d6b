"""Work cut into jobs, side by side, on one machine or many."""
