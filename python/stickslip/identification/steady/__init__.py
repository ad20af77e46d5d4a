"""Friction over slip velocity alone: points, forms of the curve, what a fit leaves, and what is said of it.

`steady_rows` takes the points from records. `curves` has the forms, `single_form_fit` fits one of them, and `form_choice`
fits all and chooses (`fit_steady`). What that returns is in `steady_result` (`SteadyFriction`); `law_of_form` turns a form
into a law. `misfit` widens intervals by what a form misses; `steady_notes` says the result, `show/steady.py` draws it.
"""
