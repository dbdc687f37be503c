"""The report: one HTML page without external files.

material gathers the numbers, claims and errata compare them with the paper, figures draws them, sections and page
write the HTML. matplotlib is imported when a figure is made.
"""
