"""The report: one HTML page without external files, on the measured screw of the paper, or on a user's own screw.

lines, screw_numbers, torque_parts and material gather the numbers; figures, screw_figures and contact_figures draw
them; the modules named tables write tables; sections and page put all into templates/. matplotlib is imported when a
figure is made.
"""
