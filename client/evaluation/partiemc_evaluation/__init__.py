"""How the methods of PartiEMC are measured: scenes with exact truth, recordings, metrics, the paper.

python3 -m partiemc_evaluation --help
"""
