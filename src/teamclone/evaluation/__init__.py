"""How good a clone is: metrics, baselines, intervals, the paper's tables and figures, the report."""
