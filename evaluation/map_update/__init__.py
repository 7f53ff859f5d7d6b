"""Labels of old maps: what is gone, what is new, what was not observed.

`sessions` reads and writes the two maps of a pair of drives, which
`map_builder` makes, with `labels` of their points. `baselines` and `free_space`
predict labels, `scores` and `structures` compare them with the ground truth.
`upkeep` updates a map by several drives, and `upkept_drive` shows the updated
map in scans.
"""
