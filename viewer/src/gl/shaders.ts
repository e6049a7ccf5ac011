/** Shader programs and what they share; no text of a store gets into them. */

import type { Model } from "../models";
import { GEOMETRY } from "./geometry.glsl";

export const HEADER = `#version 300 es
precision highp float;
precision highp int;
precision highp usampler2D;
precision highp sampler2D;
`;

/** Draws a part of a tile; \`texel\` counts the tile's own pixels. */
export const TILE_VERTEX = `${HEADER}
uniform vec4 place;   // left, top, right, bottom in clip space
uniform vec4 part;    // the same in texels of the tile
out vec2 texel;
void main() {
  vec2 corner = vec2(gl_VertexID & 1, gl_VertexID >> 1);
  gl_Position = vec4(mix(place.xy, place.zw, corner), 0.0, 1.0);
  texel = mix(part.xy, part.zw, corner);
}`;

/** Codes of a packed array, as docs/store.md defines them. */
export const CODES = `
uniform usampler2D codes;
uniform int blocks;       // texels of four codes per pixel
uniform ivec2 last;       // the last pixel of the tile
uniform vec3 coding[32];  // per column: offset, scale, 1 for log2

uint code(ivec2 at, int column) {
  uvec4 four = texelFetch(codes, ivec2(clamp(at, ivec2(0), last) * ivec2(blocks, 1)) + ivec2(column >> 2, 0), 0);
  int i = column & 3;
  return i == 0 ? four.x : i == 1 ? four.y : i == 2 ? four.z : four.w;
}

float value(uint code, int column) {
  vec3 how = coding[column];
  float linear = how.x + how.y * float(code);
  return how.z < 0.5 ? linear : code == 1u ? 0.0 : exp2(linear);
}
`;

/** Light to what is shown: the matrix of the camera, the exposure, the display. */
export const DISPLAY = `
uniform mat3 toDisplay;
uniform mat3 toDisplayRoots;
uniform float exposure;
uniform sampler2D colourMap;
uniform vec3 range;  // low, high; 1 for logarithmic, 2 for diverging

vec3 encodeSrgb(vec3 light) {
  vec3 clipped = clamp(light, 0.0, 1.0);
  return mix(1.055 * pow(clipped, vec3(1.0 / 2.4)) - 0.055, 12.92 * clipped, lessThanEqual(clipped, vec3(0.0031308)));
}

vec3 display(vec3 radiance) {
  // Products overflow beyond 1e6; all channels are scaled alike, so that the hue stays.
  vec3 x = min(radiance * exposure, vec3(1e30));
  x *= min(1.0, 1e6 / max(max(x.r, x.g), max(x.b, 1.0)));
  return toDisplay * x + toDisplayRoots * sqrt(max(x.rgb * x.gbr, vec3(0.0)));
}

vec3 falseColour(float shown) {
  float place = range.z == 1.0
    ? log(max(shown, 1e-12) / range.x) / log(range.y / range.x)
    : (shown - range.x) / (range.y - range.x);
  return texelFetch(colourMap, ivec2(int(clamp(place, 0.0, 1.0) * 255.0 + 0.5), range.z == 2.0 ? 1 : 0), 0).rgb;
}
`;

/** The fragment shader that shows one column by a colour map, or three columns as radiance. */
export const COLUMN_FRAGMENT = `${HEADER}${CODES}${DISPLAY}
uniform int column;    // the first
uniform int channels;  // 0: a value by its colour; 1 or 3: radiance
in vec2 texel;
out vec4 shown;
void main() {
  ivec2 at = ivec2(floor(texel));
  uint c = code(at, column);
  if (c == 0u) { shown = vec4(0.0, 0.0, 0.0, 1.0); return; }
  float v = value(c, column);
  if (channels == 0) { shown = vec4(falseColour(v), 1.0); return; }
  vec3 light = channels == 1 ? vec3(v) : vec3(v, value(code(at, column + 1), column + 1), value(code(at, column + 2), column + 2));
  shown = vec4(encodeSrgb(display(light)), 1.0);
}`;

/** Evaluates a model's basis for a row of inputs; results are the bits of floats, so that nothing is rounded. */
export function basisFragment(model: Model): string {
  return `${HEADER}${GEOMETRY}
uniform sampler2D inputs;  // per case: normal, light, view, shape; the index in the first w, 1 for "element" in the second
out uvec4 bits;
${model.glsl}
void main() {
  int row = int(gl_FragCoord.x);
  vec4 normal = texelFetch(inputs, ivec2(0, row), 0);
  vec4 light = texelFetch(inputs, ivec2(1, row), 0);
  vec4 view = texelFetch(inputs, ivec2(2, row), 0);
  vec4 given = texelFetch(inputs, ivec2(3, row), 0);
  float shape[MAX_SHAPE];
  for (int i = 0; i < MAX_SHAPE; i++) shape[i] = given[i];
  Optics optics = Optics(normal.w, light.w > 0.5);
  Basis b = basis(normal.xyz, shape, illumination(light.xyz, view.xyz, optics.index), optics);
  uvec4 result = uvec4(floatBitsToUint(b.diffuse), 0u, 0u, 0u);
  for (int i = 0; i < MAX_LOBES; i++) result[i + 1] = floatBitsToUint(b.specular[i]);
  bits = result;
}`;
}

export const POINT_VERTEX = `${HEADER}
void main() { gl_Position = vec4(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0, 0.0, 1.0); }`;
