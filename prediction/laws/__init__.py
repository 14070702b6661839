"""The methods: each a law of the joint velocity, given posture and hand velocity."""
