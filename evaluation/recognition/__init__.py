"""Place recognition: queries, places, scores and what is counted."""
