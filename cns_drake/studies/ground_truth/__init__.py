"""Exact ground truth of simulated drives, from rays cast in worlds."""
