"""Five kinds of charts, each described by a mapping in an experiment's file.

- `curves`: precision over recall of each method, in a panel for each pair of
  drives; it needs the answers to all queries.
- `dumbbell` (`over`, `metric`): a metric at the first and the last value of a
  factor, without and with geometric verification.
- `lines` (`over`, `metric`): a metric over a numeric factor, with a band from
  the lowest to the highest result among the seeds.
- `matrix` (`over`, `metric`, `strips`): a metric for each method and each value
  of a factor. With `strips`, each cell is divided into strips, one for each
  value of a second factor. A retained share is bold if its 95 % interval lies
  below 1.
- `scatter` (`x`, `y`): a metric over a metric or a numeric factor, with a
  smooth curve where there are enough points.

The names in brackets are keys of the mapping; `kind` names the kind of chart.
All other keys select rows: the key is a column of the table, and its value
contains the entries of this column to show. By default, `verified` is 0
(without geometric verification), or both in a dumbbell. The default task is
`place`, or the first task with the metric if `place` does not have it. Each
method has the same colour in all charts. The title names what the chart shows.

`kinds` checks and draws a chart of any kind.
"""
