"""The checks of the paper's claims, one family a file; each looks at a study and returns its verdict with its numbers."""

from stickslip.paper.checks import almost_harmonic, forced, history, thresholds

#: Every claim that is scored, in the order of the paper.
CLAIMS = almost_harmonic.CLAIMS + thresholds.CLAIMS + history.CLAIMS + forced.CLAIMS
