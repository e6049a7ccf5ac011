/** What a model leaves over, as the shader adds it: docs/store.md, "The residual term"; src/impasto/residual.py. */

import type { ResidualTerm } from "../store/attributes";
import { dot, kernelSum } from "./told";

/** Returns how much of the term is left at a light's direction. */
function share(term: ResidualTerm, direction: readonly number[]): number {
  const outside = Math.max(...term.hull.map((side) => -dot(side, direction)));
  const part = Math.min(Math.max(outside / term.fade, 0), 1);
  return 1 - part * part * (3 - 2 * part);
}

/** Returns values of one or three channels as those of three. */
export function rgb(values: readonly number[]): [number, number, number] {
  return values.length === 3 ? (values as [number, number, number]) : [values[0]!, values[0]!, values[0]!];
}

/** Returns the functions of a light's direction, with their fading: three channels for each component. */
export function residualBasis(term: ResidualTerm, direction: readonly number[]): number[][] {
  const left = share(term, direction);
  return term.weights.map((channels) =>
    rgb(channels.map((weights) => left * kernelSum(weights, term.direction, term.length, direction))),
  );
}

/** Adds a term to the radiance per unit of irradiance in one channel. */
export function withResidual(radiance: number, added: number, toe: number): number {
  const root = Math.sqrt(toe);
  return (Math.max(Math.sqrt(Math.max(radiance, 0) + toe) - root + added, 0) + root) ** 2 - toe;
}

/** The same in the shader; `components` is 0 where a program has no term to add. */
export function residualGlsl(components: number): string {
  return `
struct Residual { float coefficient[${Math.max(components, 1)}]; };
uniform usampler2D residualCodes;  // the tile's coefficients
uniform int residualBlocks;        // texels of four codes per pixel, 0 where the tile is not there yet
uniform sampler2D residualTable;   // the coefficient of each code
uniform sampler2D residualBasis;   // per component and light
uniform float toe;

Residual residual(ivec2 at) {
  Residual r;
  ivec2 place = clamp(at, ivec2(0), last) * ivec2(residualBlocks, 1);
  for (int k = 0; k < ${components}; k += 4) {
    uvec4 four = texelFetch(residualCodes, place + ivec2(k >> 2, 0), 0);
    for (int i = 0; i < 4; i++) {
      if (k + i < ${components}) r.coefficient[k + i] = texelFetch(residualTable, ivec2(int(four[i]), 0), 0).x;
    }
  }
  return r;
}

vec3 withResidual(vec3 radiance, Residual r, int light) {
  vec3 added = vec3(0.0);
  for (int k = 0; k < ${components}; k++) added += r.coefficient[k] * texelFetch(residualBasis, ivec2(k, light), 0).rgb;
  float root = sqrt(toe);
  vec3 value = max(sqrt(max(radiance, vec3(0.0)) + toe) - root + added, vec3(0.0)) + root;
  return value * value - toe;
}
`;
}
