"""Methods on motion they were not fitted on, side by side."""
