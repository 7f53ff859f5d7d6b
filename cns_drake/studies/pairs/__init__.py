"""The pairs of drives that a study measures, in each condition."""
