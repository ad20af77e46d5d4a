"""Friction laws with an internal state: smooth everywhere, stiff, without adhesion proper.

Such a law says what force slip at velocity w and state z produces and how fast z changes, :meth:`StateLaw.rates`. The core
has these right-hand sides; the motion is integrated by :func:`stickslip.integrate`, which :func:`stickslip.simulate` calls.

The state is one number, of some laws two (:attr:`StateLaw.states`); two of them are a last axis of length 2 wherever there
is a state.
"""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from stickslip import _core
from stickslip.errors import InputError
from stickslip.laws.law import Law


class StateLaw(Law, family=True):
    """What the laws with an internal state have in common."""

    @cached_property
    def core(self) -> _core.StateLaw:
        """What the core has read."""
        return _core.StateLaw(self.to_json())

    @property
    def has_state(self) -> bool:
        """Whether there is a state at all; a :class:`Regularised` law has none."""
        return self.core.has_state

    @property
    def states(self) -> int:
        """How many numbers the state is made of.

        >>> from stickslip.laws import RateState
        >>> RateState(1.0, 0.01, 0.01, 1.0, 1.0, second_b=0.005, second_length=0.1).states
        2
        """
        return self.core.states

    @property
    def _last(self) -> tuple[int, ...]:
        """The last axis of a state."""
        return (self.states,) if self.states > 1 else ()

    def rates(self, w: ArrayLike, state: ArrayLike = 0.0) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """The friction force and the rate of the state.

        Parameters
        ----------
        w : slip velocity, any shape.
        state : z, same shape or a number; of two numbers with them as the last axis, or a number that stands for both.

        Returns
        -------
        force, rate : F(w, z) with the sign it has on the mass, of that shape, and dz/dt, with the last axis of the state.

        Raises
        ------
        InputError
            where a state of two numbers has no last axis of them.

        >>> from stickslip.laws import LuGre
        >>> force, rate = LuGre(1e5, 316.0, 0.4, kinetic=1.0, break_away=1.5, scale=1e-3).rates(0.0, 1e-5)
        >>> float(force), float(rate)
        (1.0, 0.0)
        """
        slip, z = np.asarray(w, float), np.asarray(state, float)
        last = self._last
        z = z if z.ndim else np.full(last, z)
        if z.shape[z.ndim - len(last) :] != last:
            raise InputError(
                f"rates: state must have the {self.states} numbers of the law as its last axis, got the shape {z.shape}"
            )
        shape = np.broadcast_shapes(slip.shape, z.shape[: z.ndim - len(last)])
        slip, z = np.broadcast_to(slip, shape), np.broadcast_to(z, shape + last)
        force, rate = self.core.rates(np.ascontiguousarray(slip.ravel()), np.ascontiguousarray(z.ravel()))
        return force.reshape(shape), rate.reshape(shape + last)

    def steady_state(self, w: ArrayLike) -> Any:
        """The state of steady slip at velocity w; for w = 0 that of a contact that was never loaded.

        Returns
        -------
        float or array of the shape of w, for a state of two numbers with them as the last axis.
        """
        slip = np.asarray(w, float)
        state = self.core.steady(np.ascontiguousarray(slip.ravel())).reshape(slip.shape + self._last)
        return state if state.ndim else float(state)

    def state_scale(self, speed: float) -> Any:
        """The size of the state in slip at that speed, by which an integrator measures its errors; of each number."""
        size = np.abs(self.steady_state(speed))
        return np.where(size > 0, size, 1.0) if self._last else float(size) or 1.0

    def kinetic_force(self, w: ArrayLike) -> Any:
        """Friction in steady slip at velocity w, with the sign of w.

        >>> from stickslip.laws import Dahl
        >>> Dahl(stiffness=2.0, kinetic=0.5).kinetic_force([-0.1, 0.2])
        array([-0.5,  0.5])
        """
        slip = np.asarray(w, float)
        force, _ = self.rates(slip, self.steady_state(slip))
        return force if slip.ndim else float(force)

    def break_away_force(self, stick_time: ArrayLike = 0.0, force_rate: ArrayLike = 0.0) -> Any:
        """Refused: adhesion is a state here, and how much it bears depends on how it is loaded."""
        del stick_time, force_rate
        raise InputError(
            f"{type(self).__name__}: has no break-away force, as adhesion is a state of the law; "
            "simulate, or follow a motion with force_along"
        )

    def follow(
        self, t: ArrayLike, w: ArrayLike, state: ArrayLike = 0.0
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Force and state along a prescribed motion.

        Parameters
        ----------
        t, w : time (not falling) and slip velocity, shape (n,); w is linear between samples.
        state : z at the first sample; of two numbers, a single one stands for both.

        Returns
        -------
        force, state : shape (n,); a state of two numbers (n, 2).

        Between samples the state is advanced at the mean slip velocity, exactly for :class:`Dahl`, :class:`LuGre` and
        :class:`RateState` (its composite law to 1e-9); the error of that is of second order in the change of w between
        samples, and none where w is constant. A jump of w is two samples at one time.

        >>> from stickslip.laws import Dahl
        >>> force, _ = Dahl(stiffness=2.0, kinetic=1.0).follow([0, 1], [0.25, 0.25])
        >>> bool(abs(force[1] - (1 - np.exp(-0.5))) < 1e-15)
        True
        """
        times, slip = np.ascontiguousarray(t, float), np.ascontiguousarray(w, float)
        for name, values in (("t", times), ("w", slip)):
            if not np.isfinite(values).all():
                raise InputError(f"follow: {name} must be finite, got {values[~np.isfinite(values)][0]}")
        if (np.diff(times) < 0).any():
            raise InputError("follow: t must not fall; sort the samples by time")
        start = np.asarray(state, float)
        if start.shape not in [(), self._last]:
            raise InputError(f"follow: state must have the shape {self._last or '()'}, got {start.shape}")
        try:
            force, states = self.core.follow(times, slip, np.full(self.states, start))
        except ValueError as error:
            raise InputError(f"follow: {error}") from None
        return force, states.reshape(times.shape + self._last)

    def _along(
        self, t: NDArray[np.float64], w: NDArray[np.float64], stuck: NDArray[np.bool_], rate: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        del rate
        return self.follow(t, np.where(stuck, 0.0, w))[0]
