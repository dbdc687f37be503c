"""The bodies as elastic and heat-conducting half-spaces on the grid of the contact: deflection and wall temperature."""
