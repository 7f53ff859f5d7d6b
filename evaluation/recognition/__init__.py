"""Place recognition: queries, places, scores and metrics."""
