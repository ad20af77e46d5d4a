"""The judges of the paper's statements, one family a file; a judge looks at a study and says what it has seen."""

from stickslip.paper.judges import almost_harmonic, drive_velocity, forced, history

#: Every statement that is scored, in the order of the paper.
STATEMENTS = almost_harmonic.STATEMENTS + drive_velocity.STATEMENTS + history.STATEMENTS + forced.STATEMENTS
