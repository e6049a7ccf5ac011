import { trowbridgeReitz, vGroove } from "./microfacet";
import type { Model } from "./model";

/** Y = Ad max(0, n·l) + (As1 D1 + As2 D2) F G / (n·v): core/src/models/two_lobes.rs. */
export const twoLobes: Model = {
  name: "torrance-sparrow-2",
  shape: ["c", "c2"],
  lobes: 2,
  glsl: `${trowbridgeReitz.glsl}${vGroove.glsl}
Basis basis(vec3 normal, float shape[MAX_SHAPE], Illumination at, Optics optics) {
  Basis result = dark();
  float normalLight = dot(normal, at.light);
  float normalView = dot(normal, at.view);
  if (normalLight <= 0.0 || normalView <= 0.0) return result;
  float chord = chordSquared(normal, at.halfway);
  float masked = overNormalView(shape[0], normalLight, normalView, 1.0 - 0.5 * chord, at);
  float reflectance = optics.element ? fresnel(normalLight, optics.index) : at.facetReflectance;
  result.diffuse = normalLight;
  float broader[MAX_SHAPE] = shape;
  broader[0] = shape[1];
  result.specular[0] = distribution(shape, chord) * masked * reflectance;
  result.specular[1] = distribution(broader, chord) * masked * reflectance;
  return result;
}`,
};
