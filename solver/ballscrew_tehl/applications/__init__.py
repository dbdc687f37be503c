"""What uses the model: commands, identification, calibration, export, report. No step of the chain knows them."""
