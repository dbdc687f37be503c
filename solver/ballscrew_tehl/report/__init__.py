"""The report: one HTML page without external files, on the paper's screw and the paper, or on a user's own screw.

lines, screw_numbers and material gather the numbers; claims compare them with the paper; figures,
screw_figures and contact_figures draw them; the modules named tables write tables; sections and page put all into
templates/. matplotlib is imported when a figure is made.
"""
