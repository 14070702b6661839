"""Roll-outs: postures along a path that the hand is led."""
