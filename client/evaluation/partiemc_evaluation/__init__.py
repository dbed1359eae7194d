"""Measures the methods of PartiEMC: scenes with exact truth, recordings, metrics, the paper's claims.

python3 -m partiemc_evaluation --help
"""
