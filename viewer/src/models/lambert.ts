import type { Model } from "./model";

/** Y = Ad max(0, n·l): core/src/models/lambert.rs. */
export const lambert: Model = {
  name: "lambert",
  shape: [],
  lobes: 0,
  glsl: `
Basis basis(vec3 normal, float shape[MAX_SHAPE], Illumination at, Optics optics) {
  Basis result = dark();
  float normalLight = dot(normal, at.light);
  if (normalLight > 0.0 && dot(normal, at.view) > 0.0) result.diffuse = normalLight;
  return result;
}`,
};
