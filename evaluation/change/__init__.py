"""Structural change between two drives or maps.

`tcr` computes the temporal change ratio of two clouds, and `convex_hull` which
points count. `drive_maps` makes these clouds of drives and of files, and
`drive_change` reports the change.
"""
