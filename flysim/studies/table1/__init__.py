"""The paper's Table 1 again."""
