"""Which intervals of a record are sticks of its mass, and how fast the spring is wound up in them.

Sticks of a mass that creeps are decided in `creeping_sticks`, those of a mass that rests in `resting_sticks`. Which of both
applies is chosen in `draft_fit` (`fit_draft`). Sticks of instruments that measure the force itself are decided in
`instruments/direct_force/speed_sticks.py`.
"""
