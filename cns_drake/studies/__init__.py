"""What needs many drives: the benchmark, families, calibration."""

from cns_drake.base.own_packages import check_evaluation

# Before a module in here asks for the package that it evaluates with.
check_evaluation()
