import type { Model } from "./model";

/** Y = Ae + Ad max(0, n·l) + As max(0, r·v)^shininess: core/src/models/phong.rs. */
export const phong: Model = {
  name: "phong",
  shape: ["shininess"],
  lobes: 1,
  glsl: `
Basis basis(vec3 normal, float shape[MAX_SHAPE], Illumination at, Optics optics) {
  Basis result = dark();
  float normalLight = dot(normal, at.light);
  if (normalLight <= 0.0 || dot(normal, at.view) <= 0.0) return result;
  result.diffuse = normalLight;
  // r·v = 1 − |r − v|²/2 keeps its digits near the peak, where a high exponent needs them.
  vec3 difference = 2.0 * normalLight * normal - (at.light + at.view);
  float halfChord = 0.5 * dot(difference, difference);
  if (halfChord < 1.0) result.specular[0] = exp(shape[0] * logOnePlus(-halfChord));
  return result;
}`,
};
