"""Measured files to tables of columns, and columns to signals on a uniform clock.

In: paths of CSV, text, MATLAB (5 and 7.3), Parquet and NetCDF files. Out: `table.Table`, each column in the file's own unit;
`resample.resample_input` and `resample_output` on a clock, `noise.estimate_noise`; `MeasuredDataError` with file, line and remedy.

Public: `read.read_table` and `READERS` (a reader by suffix), `table.Table`, `table.MeasuredDataError`, `table.check_time`,
`headers` (units and times in headings), `resample`, `noise`. A new file kind is a reader and one line in `READERS`.
"""
