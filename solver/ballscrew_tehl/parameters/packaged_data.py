"""Folder of the packaged data: the screw of the paper, its measurements, fitted sets and maps."""

from pathlib import Path

PACKAGED_DATA = Path(__file__).parents[1] / "data"
#: the screw of the paper with the oil of the packaged mechanistic set
PACKAGED_VG100 = PACKAGED_DATA / "gd4008_vg100.toml"
