/** What a model leaves over, as the shader adds it: docs/store.md, "The residual term"; src/impasto/residual.py. */

import type { ResidualTerm } from "../store/attributes";

const dot = (a: readonly number[], b: readonly number[]) =>
  a.reduce((sum, value, i) => sum + value * b[i]!, 0);

/** Returns how much of the term is left at a light's direction. */
function share(term: ResidualTerm, direction: readonly number[]): number {
  const outside = Math.max(...term.hull.map((side) => -dot(side, direction)));
  const part = Math.min(Math.max(outside / term.fade, 0), 1);
  return 1 - part * part * (3 - 2 * part);
}

/** Returns the sum over lights n of weight n times exp(−|l − dₙ|² / 2ℓ²), of unit vectors l and dₙ. */
export function kernelSum(
  weights: readonly number[],
  lights: readonly (readonly number[])[],
  length: number,
  direction: readonly number[],
): number {
  // For unit vectors |l − d|² = 2 − 2 l·d.
  const kernel = lights.map((light) => Math.exp((Math.min(dot(light, direction), 1) - 1) / length ** 2));
  return dot(weights, kernel);
}

/** Returns the same for each channel, over the lights of a term. */
function series(
  term: ResidualTerm,
  channels: readonly (readonly number[])[],
  length: number,
  direction: readonly number[],
): [number, number, number] {
  const values = channels.map((weights) => kernelSum(weights, term.direction, length, direction));
  return values.length === 3 ? [values[0]!, values[1]!, values[2]!] : [values[0]!, values[0]!, values[0]!];
}

/** Returns the functions of a light's direction, with their fading: three channels for each component. */
export function residualBasis(term: ResidualTerm, direction: readonly number[]): number[][] {
  const left = share(term, direction);
  return term.weights.map((channels) =>
    series(term, channels, term.length, direction).map((value) => left * value),
  );
}

/** Returns how strong the lights around a direction were, in three channels. */
export function residualStrength(term: ResidualTerm, direction: readonly number[]): number[] {
  if (!term.strength) return [1, 1, 1];
  const { length, weights } = term.strength;
  const left = share(term, direction);
  return series(term, weights, length, direction).map((value) => Math.exp(left * value));
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
uniform sampler2D residualBasis;   // per component and light; then the strength of the lights around it
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
  return (value * value - toe) * texelFetch(residualBasis, ivec2(${components}, light), 0).rgb;
}
`;
}
