"""Folder of the packaged data: the screw of the paper, its measurements, fitted sets and maps."""

from pathlib import Path

PACKAGED_DATA = Path(__file__).parents[1] / "data"
