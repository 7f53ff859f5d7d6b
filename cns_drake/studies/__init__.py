"""What needs many drives: the benchmark, families, calibration."""
