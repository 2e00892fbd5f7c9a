"""Hyperparameter search: many trainings, the best of them."""
