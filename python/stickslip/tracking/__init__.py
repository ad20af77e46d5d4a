"""From films to motion: pictures with their times, finders, identities, calibration, and films made for a test."""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from stickslip.show.field import field_figure, field_plot
    from stickslip.tracking.batch import track_films
    from stickslip.tracking.bodies import rigid_body
    from stickslip.tracking.check_film import draw_tracks, tracks_over_film, write_check_film
    from stickslip.tracking.field import displacement_field
    from stickslip.tracking.film_tracking import track
    from stickslip.tracking.scale.calibration import Calibration, Lens, read_calibration
    from stickslip.tracking.scale.scale_check import FreeFall, free_fall
    from stickslip.tracking.setup import Setup
    from stickslip.tracking.synthetic import Camera, film
    from stickslip.tracking.video.osp import read_osp
    from stickslip.tracking.video.source import Film

# Imported when first asked for: the command line builds its parser from here and must not wait for numpy.
_HOME = {
    "Calibration": "scale.calibration",
    "Camera": "synthetic",
    "Film": "video.source",
    "FreeFall": "scale.scale_check",
    "Lens": "scale.calibration",
    "Setup": "setup",
    "displacement_field": "field",
    "draw_tracks": "check_film",
    "field_figure": ".show.field",
    "field_plot": ".show.field",
    "film": "synthetic",
    "free_fall": "scale.scale_check",
    "read_calibration": "scale.calibration",
    "read_osp": "video.osp",
    "rigid_body": "bodies",
    "track": "film_tracking",
    "track_films": "batch",
    "tracks_over_film": "check_film",
    "write_check_film": "check_film",
}

__all__ = [
    "Calibration",
    "Camera",
    "Film",
    "FreeFall",
    "Lens",
    "Setup",
    "displacement_field",
    "draw_tracks",
    "field_figure",
    "field_plot",
    "film",
    "free_fall",
    "read_calibration",
    "read_osp",
    "rigid_body",
    "track",
    "track_films",
    "tracks_over_film",
    "write_check_film",
]


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module 'stickslip.tracking' has no attribute {name!r}")
    value = getattr(importlib.import_module(f".{_HOME[name]}", "stickslip.tracking"), name)
    globals()[name] = value
    return value
