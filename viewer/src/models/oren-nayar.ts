import type { Model } from "./model";

/** Y = Ad n·l [A + B max(0, cos φ) sin α tan β]: core/src/models/oren_nayar.rs. */
export const orenNayar: Model = {
  name: "oren-nayar",
  shape: ["sigma"],
  lobes: 0,
  glsl: `
Basis basis(vec3 normal, float shape[MAX_SHAPE], Illumination at, Optics optics) {
  Basis result = dark();
  float normalLight = dot(normal, at.light);
  float normalView = dot(normal, at.view);
  if (normalLight <= 0.0 || normalView <= 0.0) return result;
  float sigmaSquared = shape[0] * shape[0];
  float steady = 1.0 - sigmaSquared / (2.0 * sigmaSquared + 0.66);
  float backward = 0.45 * sigmaSquared / (sigmaSquared + 0.09);
  float together = max(dot(at.light, at.view) - normalLight * normalView, 0.0);
  result.diffuse = normalLight * (steady + backward * together / max(normalLight, normalView));
  return result;
}`,
};
