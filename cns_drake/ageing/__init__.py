"""A city that lives on, year by year, from rates of real cities."""
