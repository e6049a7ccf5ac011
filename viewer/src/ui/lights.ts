/** From the lights that a person sets to those that the shader takes. */

import { MAX_LIGHTS } from "../gl/model-shader";
import type { ShaderLight } from "../gl/scene";
import { DAYLIGHT, type Light } from "./state";

export type Vector = [number, number, number];

/** Points that a light of finite size is made of. */
const POINTS = 16;

export function direction(zenith_deg: number, azimuth_deg: number): Vector {
  const [zenith, azimuth] = [(zenith_deg * Math.PI) / 180, (azimuth_deg * Math.PI) / 180];
  return [Math.sin(zenith) * Math.cos(azimuth), Math.sin(zenith) * Math.sin(azimuth), Math.cos(zenith)];
}

/** Zenith and azimuth in degrees, the inverse of `direction`. */
export function angles([x, y, z]: readonly number[]): { zenith: number; azimuth: number } {
  const degrees = 180 / Math.PI;
  return { zenith: Math.atan2(Math.hypot(x!, y!), z!) * degrees, azimuth: Math.atan2(y!, x!) * degrees };
}

/**
 * Returns the shader's lights: a light of finite size as points spread evenly over its disc.
 *
 * @param toDisplay - rows of the matrix from the camera's radiance to linear sRGB
 */
export function shaderLights(
  lights: readonly Light[],
  toDisplay: readonly (readonly number[])[],
): ShaderLight[] {
  const points = Math.min(POINTS, Math.floor(MAX_LIGHTS / lights.length));
  return lights.flatMap((light) => {
    const colour = lightColour(light.kelvin, toDisplay).map((value) => value * light.intensity) as Vector;
    const centre = direction(light.zenith, light.azimuth);
    const distance = light.distance_mm;
    const at = (towards: Vector, share: number): ShaderLight => ({
      place: distance === null ? towards : (towards.map((value) => value * distance) as Vector),
      near: distance !== null,
      colour: colour.map((value) => value * share) as Vector,
    });
    if (light.size_deg === 0) return [at(centre, 1)];
    return disc(centre, light.size_deg, points).map((towards) => at(towards, 1 / points));
  });
}

/** Directions spread over a disc of an angular diameter by the golden angle [Vogel1979]. */
function disc(centre: Vector, size_deg: number, count: number): Vector[] {
  const [x, y, z] = centre;
  // Two vectors perpendicular to the centre, which has z > 0 [Duff2017].
  const a = -1 / (1 + z);
  const first: Vector = [1 + x * x * a, x * y * a, -x];
  const second: Vector = [x * y * a, 1 + y * y * a, -y];
  const radius = Math.tan((size_deg * Math.PI) / 360);
  return Array.from({ length: count }, (_, i) => {
    const r = radius * Math.sqrt((i + 0.5) / count);
    const angle = i * Math.PI * (3 - Math.sqrt(5));
    const [u, v] = [r * Math.cos(angle), r * Math.sin(angle)];
    const moved = centre.map((value, k) => value + u * first[k]! + v * second[k]!);
    const length = Math.hypot(...moved);
    return moved.map((value) => value / length) as Vector;
  });
}

/** The colour of a black body in the camera's space, of luminance 1, as 6504 K is white. */
function lightColour(kelvin: number, toDisplay: readonly (readonly number[])[]): Vector {
  if (kelvin === DAYLIGHT) return [1, 1, 1];
  const [warm, white] = [planckRgb(kelvin), planckRgb(DAYLIGHT)];
  const shown = warm.map((value, i) => Math.max(value, 0) / white[i]!) as Vector;
  const luminance = 0.2126 * shown[0] + 0.7152 * shown[1] + 0.0722 * shown[2];
  const target = shown.map((value) => value / luminance) as Vector;
  const matrix = toDisplay.map((row) => row.slice(0, 3));
  // A root-polynomial is no matrix that could be turned back: then each channel is taken for the display's.
  return toDisplay[0]!.length === 3 ? solve(matrix, target) : target;
}

/** Linear sRGB of a black body, by the chromaticity of [Kim2002]. */
function planckRgb(kelvin: number): Vector {
  const t = Math.min(Math.max(kelvin, 1667), 25_000);
  const x =
    t <= 4000
      ? -0.2661239e9 / t ** 3 - 0.2343589e6 / t ** 2 + 0.8776956e3 / t + 0.17991
      : -3.0258469e9 / t ** 3 + 2.1070379e6 / t ** 2 + 0.2226347e3 / t + 0.24039;
  const y =
    t <= 2222
      ? -1.1063814 * x ** 3 - 1.3481102 * x ** 2 + 2.18555832 * x - 0.20219683
      : t <= 4000
        ? -0.9549476 * x ** 3 - 1.37418593 * x ** 2 + 2.09137015 * x - 0.16748867
        : 3.081758 * x ** 3 - 5.8733867 * x ** 2 + 3.75112997 * x - 0.37001483;
  const [X, Z] = [x / y, (1 - x - y) / y];
  return [
    3.2404542 * X - 1.5371385 - 0.4985314 * Z,
    -0.969266 * X + 1.8760108 + 0.041556 * Z,
    0.0556434 * X - 0.2040259 + 1.0572252 * Z,
  ];
}

/** Solves a 3 x 3 system by Cramer's rule. */
export function solve(matrix: readonly (readonly number[])[], right: Vector): Vector {
  const determinant = (m: readonly (readonly number[])[]) =>
    m[0]![0]! * (m[1]![1]! * m[2]![2]! - m[1]![2]! * m[2]![1]!) -
    m[0]![1]! * (m[1]![0]! * m[2]![2]! - m[1]![2]! * m[2]![0]!) +
    m[0]![2]! * (m[1]![0]! * m[2]![1]! - m[1]![1]! * m[2]![0]!);
  const whole = determinant(matrix);
  return [0, 1, 2].map(
    (k) => determinant(matrix.map((row, i) => row.map((value, j) => (j === k ? right[i]! : value)))) / whole,
  ) as Vector;
}
