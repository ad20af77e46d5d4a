"""What finds markers in one picture: blobs, templates, fiducial markers.

Each refines its own centre to sub-pixel: blobs by a weighted centroid (``crates/stickslip-py/src/spots/centre.rs``),
templates by subset correlation (`subset.py`), fiducial markers by their corners (`fiducial.py`).
"""
