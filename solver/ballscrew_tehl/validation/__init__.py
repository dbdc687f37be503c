"""The model compared with the published measurements and contacts."""
