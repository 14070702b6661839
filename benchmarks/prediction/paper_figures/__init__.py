"""The figures of Vianello et al. 2021 (Fig. 4, 5 and 6), from simulated operators."""
