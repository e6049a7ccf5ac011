from typing import Any

import numpy as np
from numpy.typing import NDArray

def models() -> list[dict[str, Any]]: ...
def available_instructions() -> list[str]: ...
def instructions() -> str: ...
def fit(
    model: str,
    radiance: NDArray[np.uint16] | NDArray[np.float32],
    *,
    scale: float,
    offset: float,
    light_direction: NDArray[np.float64],
    light_position_mm: NDArray[np.float64],
    light_intensity: NDArray[np.float64],
    view_direction: NDArray[np.float64],
    camera_distance_mm: float | None,
    position_mm: NDArray[np.float32] | None,
    light_rgb: NDArray[np.float64],
    clip_level: NDArray[np.float64],
    shadow_level: float,
    sample_mask: NDArray[np.uint8] | None,
    noise: tuple[float, float, float],
    index: float,
    fresnel: str,
    loss: str,
    loss_scale: float,
    max_steps: int,
    shadows: bool = False,
    coloured: bool = False,
    paper: tuple[float, float, bool, tuple[float, float, float] | None] | None = None,
    normal: NDArray[np.float32] | None = None,
    belief: tuple[NDArray[np.float32], ...] | None = None,
) -> dict[str, NDArray[Any]]: ...
def render(scene: dict[str, Any], residual: dict[str, Any] | None = None) -> NDArray[np.float32]: ...
def left_over(
    scene: dict[str, Any],
    radiance: NDArray[np.uint16] | NDArray[np.float32],
    *,
    scale: float,
    offset: float,
    clip_level: NDArray[np.float64],
    toe: float,
    encoder: NDArray[np.float32] | None = None,
) -> NDArray[Any]: ...
def basis(
    model: str,
    normal: NDArray[np.float64],
    light: NDArray[np.float64],
    view: NDArray[np.float64],
    shape: NDArray[np.float64],
    *,
    index: float,
    fresnel: str,
) -> NDArray[np.float64]: ...
def specular_scale(model: str, shape: NDArray[np.float64]) -> NDArray[np.float64]: ...
def basis_slopes(
    model: str,
    normal: NDArray[np.float64],
    shape: NDArray[np.float64],
    *,
    light_direction: NDArray[np.float64],
    light_position_mm: NDArray[np.float64],
    view_direction: NDArray[np.float64],
    camera_distance_mm: float | None,
    position_mm: NDArray[np.float32] | None,
    index: float,
    fresnel: str,
) -> NDArray[np.float64]: ...
def correct(
    codes: NDArray[np.uint16],
    *,
    row0: int,
    height: int,
    clip: int,
    table: NDArray[np.float32] | None = None,
    dark: NDArray[np.float32] | None = None,
    gain: NDArray[np.float32] | None = None,
    per_step: float | None = None,
) -> tuple[NDArray[Any], int]: ...
def zstd_encode(data: NDArray[np.uint8], level: int) -> NDArray[np.uint8]: ...
def zstd_decode(frame: bytes, out: NDArray[np.uint8]) -> None: ...
def zstd_length(frame: bytes) -> int: ...
