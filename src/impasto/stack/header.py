"""What a stack says about itself, known before anything is decoded."""

from __future__ import annotations

import hashlib

import numpy as np

from impasto import store as stores
from impasto.capture import Capture
from impasto.stack.brackets import Exposure, merged_noise
from impasto.stack.corrections import Corrections
from impasto.stack.linearise import Linearisation

# Noise in relative radiance where the capture does not state it, by the type of the photographs: an 8-bit
# encoding rounds to half a per cent of the radiance and to 0.001 near black; see docs/store.md.
_NOISE = {
    "uint8": {"read": 1e-3, "photon": 1e-5, "relative": 5e-3},
    "uint16": {"read": 1e-4, "photon": 0.0, "relative": 5e-3},
    "float32": {"read": 1e-4, "photon": 0.0, "relative": 5e-3},
}


def stack_header(
    capture: Capture,
    decoding: list[Linearisation],
    corrections: Corrections,
    exposures: list[list[Exposure]],
) -> stores.StackHeader:
    """Return what the capture says about the stack before anything is decoded."""
    first = capture.photographs[0]
    clip_level = np.min([each.clip_level for each in decoding], axis=0)
    scale, dtype = decoding[0].scale, decoding[0].dtype
    noise = {
        **_NOISE[first.dtype.name],
        **(corrections.content("oecf") or {}).get("noise", {}),
        **capture.noise,
    }
    white = corrections.white_level
    # The variance of radiance that is divided by the white's.
    noise |= {"read": noise["read"] / white, "photon": noise["photon"] / white}
    times = [exposure.time for exposure in exposures[0]]
    if len(times) > 1:
        noise = merged_noise(noise, times)
        scale, dtype = 1 / white, np.dtype(np.float32)
        # What the shortest exposure just shows, wherever a flat field lifts it most.
        clip_level = np.full(first.channels, corrections.largest_gain / min(times) / white)
    shifts = [corrections.shift(photograph.name) for photograph in capture.photographs]
    if any(shifts) and dtype.kind == "u":
        # The largest value stands for samples beyond the border of a photograph that is shifted.
        clip_level = np.minimum(clip_level, (np.iinfo(np.uint16).max - 0.5) * scale)
    said = (corrections.uncalibrated(capture.photographs), corrections.movement(capture.photographs))
    notes = [*capture.notes, *filter(None, said)]
    if (oecf := corrections.content("oecf")) is not None and oecf["linear"]:
        notes.append("the camera is linear, as its calibration found: its response is not changed")
    return stores.StackHeader(
        shape=(len(capture.photographs), first.height, first.width, first.channels),
        dtype=dtype,
        lights=capture.lights,
        camera=capture.camera,
        scale=scale,
        offset=0.0,
        clip_level=tuple(float(level) if np.isfinite(level) else None for level in clip_level),
        noise=noise,
        inputs=[
            {
                "name": photograph.name,
                "file": photograph.path.name,
                "dtype": photograph.dtype.name,
                "transfer": photograph.transfer,
                "exposure_s": photograph.exposure_s,
                "f_number": photograph.f_number,
                "iso": photograph.iso,
                **{
                    name: value
                    for name in ("camera", "lens", "taken")
                    if (value := getattr(photograph, name)) is not None
                },
                **({} if shift is None else {"shift_px": list(shift)}),
                **(
                    {"brackets": [[str(one.photograph.path.name), one.time] for one in merged[1:]]}
                    if len(merged) > 1
                    else {}
                ),
            }
            for photograph, merged, shift in zip(capture.photographs, exposures, shifts, strict=True)
        ],
        more={
            "quantisation_step": max(each.step for each in decoding),
            "light_file": {
                "file": capture.light_file.name,
                "sha256": hashlib.sha256(capture.light_file.read_bytes()).hexdigest(),
            },
            "notes": notes,
            **(corrections.attributes() if corrections.files else {}),
        },
    )
