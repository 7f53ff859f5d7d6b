"""Studies of many drives: the benchmark, families, calibration."""

from cns_drake.base.own_packages import check_evaluation

# Checked before a module in here imports `evaluation`.
check_evaluation()
