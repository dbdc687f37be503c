"""The report on a screw: one HTML page without external files.

data gathers the numbers, figures draws them, report writes tables and text into templates/page.html. page serves the
documentation of the FMUs as well.
"""
