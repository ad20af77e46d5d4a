"""The indirect method: friction k x + D x' + m x'' of a mass on a spring, from its motion between sticks."""
