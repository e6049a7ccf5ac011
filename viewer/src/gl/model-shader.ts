/** The programs that light a model, put together from what the store says about its columns. */

import type { Model } from "../models";
import type { Column } from "../store/attributes";
import { GEOMETRY } from "./geometry.glsl";
import { residualGlsl } from "./residual";
import { CODES, DISPLAY, HEADER } from "./shaders";

export const MAX_LIGHTS = 32;

/** What the picture shows; the numbers are those of `mode` in the shader. */
export const MODES = {
  radiance: 0,
  diffuse: 1,
  specular: 2,
  normal: 3,
  albedo: 4,
  ratio: 5,
  gloss: 6,
  residual: 7,
} as const;
export type Mode = keyof typeof MODES;

/** Where a map of the model lies among the columns. */
function first(columns: readonly Column[], name: string): number {
  return columns.findIndex((column) => column.name === name);
}

/** What a program is made for: less to decide per pixel, and less to compile before the first picture. */
export interface Variant {
  readonly mode: Mode;
  /** Whether to blend four pixels. */
  readonly smooth: boolean;
  readonly exaggerated: boolean;
  /** Components of the residual term, 0 without one. */
  readonly components: number;
}

/** The fragment shader that lights a tile of a model's parameters. */
export function modelFragment(
  model: Model,
  columns: readonly Column[],
  channels: number,
  { mode, smooth, exaggerated, components }: Variant,
): string {
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
  return `${HEADER}${GEOMETRY}${CODES}${DISPLAY}${residualGlsl(components)}
const int mode = ${MODES[mode]};
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

struct Pixel { bool missing; vec3 normal; vec3 diffuse; vec3 highlight; float specular[MAX_LOBES]; float shape[MAX_SHAPE]; vec3 ambient; vec3 view; bool tilted; };

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
  p.highlight = specularColour${at("specular_rgb") < 0 ? "" : ` * ${colour("specular_rgb")}`};
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

/** What the lights make of a pixel; in the mode of the residual, what it adds to that. */
vec3 radiance(Pixel p, ivec2 at) {
  const float diffusePart = mode == ${MODES.specular} ? 0.0 : 1.0;
  const float specularPart = mode == ${MODES.diffuse} ? 0.0 : 1.0;
  vec2 place = position.xy + position.zw * vec2(at);
  vec3 view = camera.w > 0.5 ? normalize(camera.xyz - vec3(place, 0.0)) : camera.xyz;
  if (p.tilted) view = p.view;
  ${components > 0 ? "Residual r = residual(at);" : ""}
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
    vec3 reflected = diffusePart * (p.diffuse * b.diffuse + p.ambient) + specularPart * lobes * p.highlight;
    ${addition(mode, components)}
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
${
  exaggerated
    ? `  vec3 mean = meanNormal(at);
  p.normal = normalize(p.normal + exaggeration * (p.normal - normalize(mean + vec3(0.0, 0.0, 1e-6))));
  p.normal.z = max(p.normal.z, 1e-3);
  p.normal = normalize(p.normal);`
    : ""
}
  if (mode == ${MODES.normal}) return vec4(0.5 + 0.5 * p.normal, 1.0);
  if (mode == ${MODES.albedo}) return vec4(display(p.diffuse), 1.0);
  if (mode == ${MODES.ratio}) return vec4(${model.lobes > 0 ? "p.specular[0]" : "0.0"} / max(luminance(p.diffuse), 1e-6), 0.0, 0.0, 1.0);
  if (mode == ${MODES.gloss}) return vec4(glossUnits(p), 0.0, 0.0, 1.0);
  vec3 lit = radiance(p, at);
  return mode == ${MODES.residual} ? vec4(luminance(lit), 0.0, 0.0, 1.0) : vec4(display(lit), 1.0);
}

void main() {
  ${smooth ? SMOOTH : "vec4 sum = shade(ivec2(floor(texel)));"}
  vec3 colour = mode == ${MODES.normal} ? sum.rgb : mode >= ${MODES.ratio} ? falseColour(sum.r) : encodeSrgb(sum.rgb);
  shown = sum.a > 0.0 ? vec4(colour, 1.0) : vec4(0.0, 0.0, 0.0, 1.0);
}`;
}

/** Blends the radiance of four pixels; a loop, as their code four times over takes long to compile. */
const SMOOTH = `vec2 corner = floor(texel - 0.5);
  vec2 along = texel - 0.5 - corner;
  vec4 sum = vec4(0.0);
  for (int i = 0; i < 4; i++) {
    ivec2 step = ivec2(i & 1, i >> 1);
    vec2 share = mix(1.0 - along, along, vec2(step));
    sum += share.x * share.y * shade(ivec2(corner) + step);
  }
  if (sum.a > 0.0) sum.rgb /= sum.a;`;

/** What the residual term does to the light that a pixel reflects. */
function addition(mode: Mode, components: number): string {
  if (components === 0) return mode === "residual" ? "reflected = vec3(0.0);" : "";
  if (mode === "residual")
    return "reflected = residualBlocks > 0 ? withResidual(reflected, r, i) - reflected : vec3(0.0);";
  return mode === "radiance" ? "if (residualBlocks > 0) reflected = withResidual(reflected, r, i);" : "";
}
