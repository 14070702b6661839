"""From demonstrations to an operator model."""
