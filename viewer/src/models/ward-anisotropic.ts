import type { Model } from "./model";

/** Y = Ad max(0, n·l) + As √(n·l / n·v) exp(−q), q of correlated slopes: core/src/models/ward_anisotropic.rs. */
export const wardAnisotropic: Model = {
  name: "ward-anisotropic",
  shape: ["alpha_x", "alpha_y", "correlation"],
  lobes: 1,
  glsl: `
Basis basis(vec3 normal, float shape[MAX_SHAPE], Illumination at, Optics optics) {
  Basis result = dark();
  float normalLight = dot(normal, at.light);
  float normalView = dot(normal, at.view);
  if (normalLight <= 0.0 || normalView <= 0.0) return result;
  float chord = chordSquared(normal, at.halfway);
  float normalHalf = 1.0 - 0.5 * chord;
  vec3 offset = at.halfway - normal;
  float along = (offset.z - 0.5 * chord) / (1.0 + normal.z);
  vec2 slopes = (offset.xy - normal.xy * along) / (normalHalf * vec2(shape[0], shape[1]));
  float q = dot(slopes, slopes) - 2.0 * shape[2] * slopes.x * slopes.y;
  result.diffuse = normalLight;
  result.specular[0] = exp(-q / (1.0 - shape[2] * shape[2])) * sqrt(normalLight / normalView);
  return result;
}`,
};
