"""Between laws: the choice of a form, and the comparison on held-back slips."""
