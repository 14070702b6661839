"""The digital human: model, kinematics, dynamics, motions and the readers of recordings."""
