"""Measured signals: files to tables, tables to signals on one uniform clock, and their noise."""
