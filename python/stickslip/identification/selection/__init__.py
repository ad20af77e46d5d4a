"""Between laws: comparison on held-back slips, agreement of motions, predictions."""
