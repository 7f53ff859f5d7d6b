"""Buildings that stand alone: churches, schools, stations, car parks."""
