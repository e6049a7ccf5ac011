import type { Distribution, Masking } from "./microfacet";
import type { Model } from "./model";

/** Y = Ad max(0, n·l) + As D F G / (n·v): core/src/models/torrance_sparrow.rs. */
export function torranceSparrow(name: string, d: Distribution, g: Masking): Model {
  return {
    name,
    shape: d.shape,
    lobes: 1,
    glsl: `${d.glsl}${g.glsl}
Basis basis(vec3 normal, float shape[MAX_SHAPE], Illumination at, Optics optics) {
  Basis result = dark();
  float normalLight = dot(normal, at.light);
  float normalView = dot(normal, at.view);
  if (normalLight <= 0.0 || normalView <= 0.0) return result;
  float chord = chordSquared(normal, at.halfway);
  float masked = overNormalView(shape[0], normalLight, normalView, 1.0 - 0.5 * chord, at);
  float reflectance = optics.element ? fresnel(normalLight, optics.index) : at.facetReflectance;
  result.diffuse = normalLight;
  result.specular[0] = distribution(shape, chord) * masked * reflectance;
  return result;
}`,
  };
}
