"""The quality of a clone: metrics, baselines, intervals, the paper's figures."""
