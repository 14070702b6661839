"""What the body bears now: contacts, base velocity, external wrenches and joint torques."""
