"""Localisation of single scans, or of a drive, in a map.

`localisation_map` makes a map, and `estimators` registers a scan to it, from
`initial_poses` that are random. `localise` does so with many scans, `tracking`
with a drive. `results` summarises the records of both. `robust_icp` and `fit`
are parts of estimators, and `settings` contains their settings. `one_scan`
reads a single cloud as a drive.
"""
