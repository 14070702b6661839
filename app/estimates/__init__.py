"""Torques, efforts and payload of a recording, from motion and foot forces."""
