"""Tables, figures and the page of a report.

`contents` says what a report contains. `page` writes the report's files, from
the tables in `tables`, the pictures of `charts`, `curve_figures`, `map_figures`
and `route_pictures`, and the data that `page_data` makes for the page's script.
"""
