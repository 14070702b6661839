"""From force plates and moving soles to what the ground does to each foot."""
