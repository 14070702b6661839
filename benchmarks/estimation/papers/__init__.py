"""The experiments of Latella et al. 2019 and Tirupachuri et al. 2021, on simulated people."""
