/** What the photographs' lights tell of others, their distance: docs/store.md; src/impasto/residual.py. */

import type { Told } from "../store/attributes";

export const dot = (a: readonly number[], b: readonly number[]) =>
  a.reduce((sum, value, i) => sum + value * b[i]!, 0);

/** Returns the logarithm told for a direction, a unit vector; `fitted` are the lights'. */
export function told(
  { table, weights, length }: Told,
  fitted: readonly (readonly number[])[],
  direction: readonly number[],
): number {
  return table ? lookUp(table[0], direction) : kernelSum(weights![0], fitted, length!, direction);
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

/** Returns what a table says of a direction, bilinear in both angles; azimuths go around. */
function lookUp(table: readonly (readonly number[])[], [x, y, z]: readonly number[]): number {
  const rows = table.length;
  const columns = table[0]!.length;
  const zenith = Math.min(Math.atan2(Math.hypot(x!, y!), z!) / (Math.PI / 2), 1) * (rows - 1);
  const azimuth = (Math.atan2(y!, x!) / (2 * Math.PI)) * columns;
  const row = Math.min(Math.floor(zenith), rows - 2);
  const column = Math.floor(azimuth);
  const [down, along] = [zenith - row, azimuth - column];
  const first = (column + columns) % columns;
  const second = (first + 1) % columns;
  const between = (values: readonly number[]) => values[first]! * (1 - along) + values[second]! * along;
  return between(table[row]!) * (1 - down) + between(table[row + 1]!) * down;
}
