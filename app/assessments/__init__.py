"""Candidate robot trajectories, ranked by what they do to the person."""
