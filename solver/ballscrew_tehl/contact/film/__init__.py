"""The oil film between the bodies: properties of the oil, generalised Reynolds equation, energy equation."""
