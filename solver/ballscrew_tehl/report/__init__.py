"""The report: one HTML page that holds everything it shows.

material gathers the numbers, claims and errata hold them against the paper, figures draws them, sections and page
write them down. matplotlib is imported when a figure is made.
"""
