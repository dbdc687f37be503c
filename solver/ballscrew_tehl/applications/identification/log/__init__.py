"""A log of a drive: its file, its units, what its rows show, its signals."""
