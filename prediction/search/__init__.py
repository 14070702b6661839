"""Search for the weights and the kernel of MI-NsGP, and how well they are told."""
