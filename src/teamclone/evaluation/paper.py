"""The figures that Coimbra and Máximo published, and those recomputed from their counts.

Published: "Team Modeling with Deep Behavioral Cloning for the RoboCup 2D Soccer Simulation League", section III and
Table IV. Corrected: recomputed from the counts in the notebook of their public code, whose "recall" and "specificity"
count as false negatives all errors that are not predicted as the command, whatever was given (see `metrics.Rates`).
"""

from __future__ import annotations

TEAM = "HELIOS2019"

PUBLISHED: dict[str, float] = {"accuracy": 0.845, "paper_mae": 0.069}
CORRECTED: dict[str, float] = {
    "accuracy": 0.8455,
    "cross_entropy": 0.3531,
    "balanced_accuracy": 0.644,
    "macro_f1": 0.675,
    "paper_mae": 0.0687,
    "majority": 0.6775,
}
UNSEEN: dict[str, float] = {"accuracy": 0.8408, "cross_entropy": 0.3618, "paper_mae": 0.0692}
"""Against six teams that training had not seen."""

TABLE_IV: dict[str, tuple[float, float, float, float]] = {
    "share": (0.6263, 0.2091, 0.0100, 0.000084),
    "recall": (0.9244, 0.6771, 0.7634, 0.21),
    "precision": (0.8560, 0.8082, 0.7764, 0.5336),
    "paper_recall": (0.9226, 0.6659, 0.0621, 0.00054),
    "paper_specificity": (0.6825, 0.9277, 0.9966, 0.9999),
}
"""Table IV by field of `metrics.Rates`, in the order of CLONED_KINDS; the published rows Accuracy, Scaled Accuracy,
Precision, Recall, Specificity."""

TABLE_IV_NAMES: dict[str, str] = {
    "share": "Accuracy",
    "recall": "Scaled accuracy",
    "precision": "Precision",
    "paper_recall": "Recall, as the paper computed it",
    "paper_specificity": "Specificity, as the paper computed it",
}

RESPONSE_MS = (1.4, 0.2)
"""Mean and standard deviation of one prediction (TensorFlow, one state)."""
