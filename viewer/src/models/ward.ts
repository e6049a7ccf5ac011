import type { Model } from "./model";

/** Y = Ad max(0, n·l) + As √(n·l / n·v) exp(−tan² δ / α²): core/src/models/ward.rs. */
export const ward: Model = {
  name: "ward",
  shape: ["alpha"],
  lobes: 1,
  glsl: `
Basis basis(vec3 normal, float shape[MAX_SHAPE], Illumination at, Optics optics) {
  Basis result = dark();
  float normalLight = dot(normal, at.light);
  float normalView = dot(normal, at.view);
  if (normalLight <= 0.0 || normalView <= 0.0) return result;
  float chord = chordSquared(normal, at.halfway);
  float normalHalf = 1.0 - 0.5 * chord;
  float slope = sineSquared(chord) / (normalHalf * normalHalf * shape[0] * shape[0]);
  result.diffuse = normalLight;
  result.specular[0] = exp(-slope) * sqrt(normalLight / normalView);
  return result;
}`,
};
