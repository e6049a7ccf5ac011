import { MAX_LOBES, MAX_SHAPE } from "../models";

/** Directions of light and view, Fresnel's reflectance and the numbers that need care: core/src/geometry.rs, fresnel.rs. */
export const GEOMETRY = `
#define MAX_SHAPE ${MAX_SHAPE}
#define MAX_LOBES ${MAX_LOBES}

struct Basis { float diffuse; float specular[MAX_LOBES]; };
struct Optics { float index; bool element; };
struct Illumination { vec3 light; vec3 view; vec3 halfway; float perLightHalf; float facetReflectance; };

Basis dark() {
  Basis result;
  result.diffuse = 0.0;
  for (int i = 0; i < MAX_LOBES; i++) result.specular[i] = 0.0;
  return result;
}

// For unpolarised light [CookTorrance1982, Eq. 15].
float fresnel(float cosine, float index) {
  float g = sqrt(cosine * cosine + (index * index - 1.0));
  float sum = g + cosine;
  float difference = g - cosine;
  float above = cosine * sum - 1.0;
  float below = cosine * difference + 1.0;
  float ratio = difference / (sum * below);
  return 0.5 * ratio * ratio * (above * above + below * below);
}

Illumination illumination(vec3 light, vec3 view, float index) {
  vec3 sum = light + view;
  float squared = dot(sum, sum);
  float inverse = 1.0 / sqrt(squared);
  return Illumination(light, view, sum * inverse, 2.0 * inverse, fresnel(0.5 * squared * inverse, index));
}

// |a − b|² of unit vectors, without cancellation where they nearly agree.
float chordSquared(vec3 a, vec3 b) {
  vec3 difference = a - b;
  return dot(difference, difference);
}

float sineSquared(float chord) { return chord * (1.0 - 0.25 * chord); }

// log(1 + x): the built-in one loses its digits near 1.
float logOnePlus(float x) {
  if (abs(x) > 0.25) return log(1.0 + x);
  float s = x / (2.0 + x);
  float q = s * s;
  return 2.0 * s * (1.0 + q * (1.0 / 3.0 + q * (0.2 + q * (1.0 / 7.0 + q / 9.0))));
}
`;
