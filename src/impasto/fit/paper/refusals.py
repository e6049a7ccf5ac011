"""What the paper's procedure is not defined for."""

from __future__ import annotations

import numpy as np

from impasto.arm import PLANE_TOLERANCE_DEG, Arm
from impasto.errors import Problem
from impasto.fit.paper.threshold import LEAST_DEG, lights_beyond
from impasto.fit.procedure import FitOptions
from impasto.geometry import Camera, Lights
from impasto.models import ModelSpec


def lights_needed(model: ModelSpec) -> int:
    """Return how many lights the diffuse stage needs for each pixel: its unknowns, and one."""
    return 3 + int(model.ambient)


def refusals(
    model: ModelSpec, arm: Arm, lights: Lights, camera: Camera, options: FitOptions
) -> list[Problem]:
    """Return everything about a model, lights and a camera that the procedure cannot do with."""
    problems = []
    if (model.lobes, len(model.shape)) != (1, 1):
        problems.append(
            Problem(
                where=f"--model {model.name}",
                what=f"has {model.lobes} lobes and {len(model.shape)} shape parameters; the paper's "
                "procedure expects one of each",
                do="Choose a model such as torrance-sparrow or phong, or --procedure joint",
            )
        )
    if not arm.planar:
        problems.append(_not_planar(arm))
    near = [
        name for name, place in zip(lights.names, lights.position_mm, strict=True) if np.isfinite(place[0])
    ]
    if near:
        problems.append(
            Problem(
                where=f"light {near[0]}" + f" and {len(near) - 1} more" * (len(near) > 1),
                what="stands at a finite distance; the paper's procedure expects one direction for all "
                "pixels",
                do="Use --procedure joint, or give directions instead of positions and stack again",
            )
        )
    if camera.distance_mm is not None:
        problems.append(
            Problem(
                where="camera",
                what=f"stands at {camera.distance_mm:g} mm; the paper's procedure expects one direction of "
                "view for all pixels",
                do="Use --procedure joint, or leave distance_mm out of the light file and stack again",
            )
        )
    if arm.planar:
        problems += _too_few(model, arm, lights, camera, options)
    return problems


def _not_planar(arm: Arm) -> Problem:
    own = np.degrees(arm.off_own_plane)
    what = f"are up to {np.degrees(arm.off_plane):.1f}° from any one plane through the painting's normal"
    if own <= PLANE_TOLERANCE_DEG:
        what = f"lie in one plane, but {what}"
    return Problem(
        where="lights",
        what=f"{what}; the paper's procedure expects an arm, at most {PLANE_TOLERANCE_DEG:g}° from it",
        do="Use --procedure joint, or leave out the other lights with --exclude",
    )


def _too_few(
    model: ModelSpec, arm: Arm, lights: Lights, camera: Camera, options: FitOptions
) -> list[Problem]:
    threshold_deg = LEAST_DEG if options.threshold_deg is None else options.threshold_deg
    left = lights_beyond(
        np.radians(threshold_deg), arm.lights(lights).direction, arm.camera(camera).view_direction
    )
    needed = lights_needed(model)
    if left >= needed:
        return []
    return [
        Problem(
            where=f"--threshold {threshold_deg:g}",
            what=f"leaves {left} of {len(lights)} lights to the diffuse term, and {needed} are needed for "
            f"{model.name}",
            do="Choose a smaller threshold, or take photographs from more angles",
        )
    ]
