"""Ageing of cities year by year, at the rates of change of real cities."""
