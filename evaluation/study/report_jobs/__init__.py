"""The jobs of a report on recordings, and the figures that they draw."""
