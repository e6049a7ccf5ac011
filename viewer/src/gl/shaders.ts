/** Shader programs, put together from what the store says about its columns; no text of the store gets in. */

import type { Model } from "../models";
import type { Column } from "../store/published";
import { GEOMETRY } from "./geometry.glsl";

export const MAX_LIGHTS = 32;

/** What the picture shows; the numbers are those of the uniform `mode`. */
export const MODES = {
  radiance: 0,
  diffuse: 1,
  specular: 2,
  normal: 3,
  albedo: 4,
  ratio: 5,
  gloss: 6,
} as const;
export type Mode = keyof typeof MODES;

const HEADER = `#version 300 es
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
const CODES = `
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
const DISPLAY = `
uniform mat3 toDisplay;
uniform mat3 toDisplayRoots;
uniform float exposure;
uniform sampler2D colourMap;
uniform vec3 range;  // low, high, 1 for logarithmic

vec3 encodeSrgb(vec3 light) {
  vec3 clipped = clamp(light, 0.0, 1.0);
  return mix(1.055 * pow(clipped, vec3(1.0 / 2.4)) - 0.055, 12.92 * clipped, lessThanEqual(clipped, vec3(0.0031308)));
}

vec3 display(vec3 radiance) {
  vec3 x = min(radiance * exposure, vec3(1e6));
  return toDisplay * x + toDisplayRoots * sqrt(max(x.rgb * x.gbr, vec3(0.0)));
}

vec3 falseColour(float shown) {
  float place = range.z > 0.5
    ? log(max(shown, 1e-12) / range.x) / log(range.y / range.x)
    : (shown - range.x) / (range.y - range.x);
  return texture(colourMap, vec2(clamp(place, 0.0, 1.0) * (255.0 / 256.0) + 0.5 / 256.0, 0.5)).rgb;
}
`;

/** Where a map of the model lies among the columns. */
function first(columns: readonly Column[], name: string): number {
  return columns.findIndex((column) => column.name === name);
}

/** The fragment shader that lights a tile of a model's parameters. */
export function modelFragment(model: Model, columns: readonly Column[], channels: number): string {
  const at = (name: string) => first(columns, name);
  const colour = (name: string) =>
    channels === 3
      ? `vec3(${[0, 1, 2].map((i) => `value(code(at, ${at(name) + i}), ${at(name) + i})`).join(", ")})`
      : `vec3(value(code(at, ${at(name)}), ${at(name)}))`;
  const shape = model.shape
    .map((name, i) => `  p.shape[${i}] = matte ? 0.5 : value(code(at, ${at(name)}), ${at(name)});`)
    .join("\n");
  const lobes = Array.from({ length: model.lobes }, (_, i) => i);
  const unseen = [...lobes.map((i) => at("specular") + i), ...model.shape.map(at)];
  const tilt = at("view_tilt");
  return `${HEADER}${GEOMETRY}${CODES}${DISPLAY}
uniform int mode;
uniform int samples;           // per side: 1 takes the nearest pixel, 2 blends four
uniform float exaggeration;
uniform usampler2D coarse;     // a coarser tile, for the mean of the normals around
uniform vec4 coarsePlace;      // factor and offset from texels of this tile, its last pixel
uniform int lightCount;
uniform vec4 lightPlace[${MAX_LIGHTS}];   // direction, or position in mm where w is 1
uniform vec3 lightColour[${MAX_LIGHTS}];
uniform vec4 camera;           // direction, or position in mm where w is 1
uniform vec4 position;         // mm of texel (0, 0), mm per texel in x and y
uniform vec3 specularColour;
uniform Optics optics;
uniform vec2 armAzimuth;       // cosine and sine
uniform sampler2D glossTable;
uniform vec4 glossAxes;        // log of the lower bound and of the ratio, for two parameters
in vec2 texel;
out vec4 shown;

struct Pixel { bool missing; vec3 normal; vec3 diffuse; float specular[MAX_LOBES]; float shape[MAX_SHAPE]; vec3 ambient; vec3 view; bool tilted; };

vec3 unitNormal(uint x, uint y) {
  vec2 xy = vec2(value(x, 0), value(y, 1));
  return vec3(xy, sqrt(max(1.0 - dot(xy, xy), 0.0)));
}

Pixel pixel(ivec2 at) {
  Pixel p;
  uint x = code(at, 0);
  p.missing = x == 0u;
  p.normal = unitNormal(x, code(at, 1));
  p.diffuse = ${colour("diffuse")};
  bool matte = ${unseen.length ? unseen.map((i) => `code(at, ${i}) == 0u`).join(" || ") : "false"};
  for (int i = 0; i < MAX_LOBES; i++) p.specular[i] = 0.0;
  for (int i = 0; i < MAX_SHAPE; i++) p.shape[i] = 0.5;
${lobes.map((i) => `  p.specular[${i}] = matte ? 0.0 : value(code(at, ${at("specular") + i}), ${at("specular") + i});`).join("\n")}
${shape}
  p.ambient = ${at("ambient") < 0 ? "vec3(0.0)" : colour("ambient")};
  p.tilted = ${tilt >= 0};
  float tilt = ${tilt < 0 ? "0.0" : `matte ? 0.0 : value(code(at, ${tilt}), ${tilt})`};
  p.view = vec3(sin(tilt) * armAzimuth, cos(tilt));
  return p;
}

vec3 meanNormal(ivec2 at) {
  ivec2 centre = ivec2(floor((vec2(at) + 0.5) * coarsePlace.x + coarsePlace.yz));
  ivec2 end = ivec2(int(coarsePlace.w) & 1023, int(coarsePlace.w) >> 10);
  vec3 sum = vec3(0.0);
  for (int y = -2; y <= 2; y += 2) for (int x = -2; x <= 2; x += 2) {
    ivec2 place = clamp(centre + ivec2(x, y), ivec2(0), end);
    uvec4 four = texelFetch(coarse, place * ivec2(blocks, 1), 0);
    if (four.x != 0u) sum += unitNormal(four.x, four.y);
  }
  return sum;
}

${model.glsl}

vec3 radiance(Pixel p, ivec2 at, float diffusePart, float specularPart) {
  vec2 place = position.xy + position.zw * vec2(at);
  vec3 view = camera.w > 0.5 ? normalize(camera.xyz - vec3(place, 0.0)) : camera.xyz;
  if (p.tilted) view = p.view;
  vec3 sum = vec3(0.0);
  for (int i = 0; i < lightCount; i++) {
    vec3 direction = lightPlace[i].xyz;
    float falloff = 1.0;
    if (lightPlace[i].w > 0.5) {
      vec3 offset = direction - vec3(place, 0.0);
      float squared = dot(offset, offset);
      falloff = dot(direction, direction) / squared;
      direction = offset / sqrt(squared);
    }
    Basis b = basis(p.normal, p.shape, illumination(direction, view, optics.index), optics);
    float lobes = 0.0;
    for (int j = 0; j < ${model.lobes}; j++) if (p.specular[j] > 0.0) lobes += p.specular[j] * b.specular[j];
    vec3 reflected = diffusePart * (p.diffuse * b.diffuse + p.ambient) + specularPart * lobes * specularColour;
    sum += reflected * falloff * lightColour[i];
  }
  return sum;
}

float luminance(vec3 colour) { return dot(colour, vec3(0.2126, 0.7152, 0.0722)); }

float glossUnits(Pixel p) {
  ivec2 size = textureSize(glossTable, 0) - 1;
  vec2 place = vec2(0.0);
  ${model.shape.length > 0 ? "place.x = (log(p.shape[0]) - glossAxes.x) / glossAxes.y;" : ""}
  ${model.shape.length > 1 ? "place.y = (log(p.shape[1]) - glossAxes.z) / glossAxes.w;" : ""}
  place = clamp(place, 0.0, 1.0) * vec2(size);
  ivec2 low = min(ivec2(place), max(size - 1, ivec2(0)));
  vec2 along = place - vec2(low);
  vec4 a = mix(texelFetch(glossTable, low, 0), texelFetch(glossTable, min(low + ivec2(1, 0), size), 0), along.x);
  vec4 b = mix(texelFetch(glossTable, min(low + ivec2(0, 1), size), 0), texelFetch(glossTable, min(low + ivec2(1, 1), size), 0), along.x);
  vec4 unit = exp(mix(a, b, along.y));
  float units = luminance(p.diffuse / specularColour) * unit.x;
  for (int j = 0; j < ${model.lobes}; j++) units += p.specular[j] * unit[j + 1];
  return units;
}

vec4 shade(ivec2 at) {
  Pixel p = pixel(at);
  if (p.missing) return vec4(0.0);
  if (exaggeration > 0.0) {
    vec3 mean = meanNormal(at);
    p.normal = normalize(p.normal + exaggeration * (p.normal - normalize(mean + vec3(0.0, 0.0, 1e-6))));
    p.normal.z = max(p.normal.z, 1e-3);
    p.normal = normalize(p.normal);
  }
  if (mode == ${MODES.normal}) return vec4(0.5 + 0.5 * p.normal, 1.0);
  if (mode == ${MODES.albedo}) return vec4(display(p.diffuse), 1.0);
  if (mode == ${MODES.ratio}) return vec4(${model.lobes > 0 ? "p.specular[0]" : "0.0"} / max(luminance(p.diffuse), 1e-6), 0.0, 0.0, 1.0);
  if (mode == ${MODES.gloss}) return vec4(glossUnits(p), 0.0, 0.0, 1.0);
  return vec4(display(radiance(p, at, mode == ${MODES.specular} ? 0.0 : 1.0, mode == ${MODES.diffuse} ? 0.0 : 1.0)), 1.0);
}

void main() {
  vec4 sum;
  if (samples == 1) sum = shade(ivec2(floor(texel)));
  else {
    vec2 corner = floor(texel - 0.5);
    vec2 along = texel - 0.5 - corner;
    ivec2 at = ivec2(corner);
    sum = mix(mix(shade(at), shade(at + ivec2(1, 0)), along.x), mix(shade(at + ivec2(0, 1)), shade(at + ivec2(1, 1)), along.x), along.y);
    if (sum.a > 0.0) sum.rgb /= sum.a;
  }
  vec3 colour = mode == ${MODES.normal} ? sum.rgb : mode >= ${MODES.ratio} ? falseColour(sum.r) : encodeSrgb(sum.rgb);
  shown = sum.a > 0.0 ? vec4(colour, 1.0) : vec4(0.0, 0.0, 0.0, 1.0);
}`;
}

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
