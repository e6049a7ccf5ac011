/** The shader's basis values as numbers: for the curves of a pixel, and for tests against the core. */

import { MAX_LOBES, type Model } from "../models";
import { floatTexture, Program } from "./program";
import { basisFragment, POINT_VERTEX } from "./shaders";

export interface BasisCase {
  readonly normal: readonly number[];
  readonly light: readonly number[];
  readonly view: readonly number[];
  readonly shape: readonly number[];
}

export interface BasisOptics {
  readonly index: number;
  readonly element: boolean;
}

const programs = new WeakMap<WebGL2RenderingContext, Map<string, Program>>();

/** Returns diffuse and one value per lobe for each case, as the graphics card computes them. */
export function evaluateBasis(
  gl: WebGL2RenderingContext,
  model: Model,
  optics: BasisOptics,
  cases: readonly BasisCase[],
): number[][] {
  const known = programs.get(gl) ?? new Map<string, Program>();
  programs.set(gl, known);
  let program = known.get(model.name);
  if (!program) {
    program = new Program(gl, POINT_VERTEX, basisFragment(model));
    known.set(model.name, program);
  }
  const results: number[][] = [];
  const step = 1024;
  for (let start = 0; start < cases.length; start += step) {
    results.push(...evaluateRow(gl, program, optics, cases.slice(start, start + step), 1 + model.lobes));
  }
  return results;
}

function evaluateRow(
  gl: WebGL2RenderingContext,
  program: Program,
  optics: BasisOptics,
  cases: readonly BasisCase[],
  width: number,
): number[][] {
  const inputs = new Float32Array(cases.length * 16);
  cases.forEach((each, row) => {
    inputs.set([...each.normal, optics.index, ...each.light, optics.element ? 1 : 0], 16 * row);
    inputs.set([...each.view, 0, ...each.shape], 16 * row + 8);
  });
  const texture = floatTexture(gl, 4, cases.length, inputs);
  const target = gl.createTexture();
  gl.bindTexture(gl.TEXTURE_2D, target);
  gl.texStorage2D(gl.TEXTURE_2D, 1, gl.RGBA32UI, cases.length, 1);
  const framebuffer = gl.createFramebuffer();
  gl.bindFramebuffer(gl.FRAMEBUFFER, framebuffer);
  gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, target, 0);
  gl.viewport(0, 0, cases.length, 1);
  gl.disable(gl.SCISSOR_TEST);
  program.use();
  gl.activeTexture(gl.TEXTURE0);
  gl.bindTexture(gl.TEXTURE_2D, texture);
  program.int("inputs", 0);
  gl.drawArrays(gl.TRIANGLES, 0, 3);
  const bits = new Uint32Array(cases.length * 4);
  gl.readPixels(0, 0, cases.length, 1, gl.RGBA_INTEGER, gl.UNSIGNED_INT, bits);
  gl.bindFramebuffer(gl.FRAMEBUFFER, null);
  gl.deleteFramebuffer(framebuffer);
  gl.deleteTexture(target);
  gl.deleteTexture(texture);
  const values = new Float32Array(bits.buffer);
  return cases.map((_, row) =>
    Array.from(values.subarray(4 * row, 4 * row + Math.min(width, 1 + MAX_LOBES))),
  );
}
