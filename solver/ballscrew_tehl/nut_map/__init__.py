"""The nut map: friction and film of a whole nut over axial force, speed and temperature; imports nothing by itself."""
