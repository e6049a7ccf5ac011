/** Factors of a microfacet lobe: core/src/models/microfacet.rs in GLSL. */

/** D, as `float distribution(float shape[MAX_SHAPE], float chord)`; the chord is |n − h|² = 2 (1 − n·h). */
export interface Distribution {
  readonly shape: readonly string[];
  readonly glsl: string;
}

/** G / (n·v), as `float overNormalView(float shape, float normalLight, float normalView, float normalHalf, Illumination at)`. */
export interface Masking {
  readonly glsl: string;
}

/** [TrowbridgeReitz1975], [Chen2007] Eq. 3. */
export const trowbridgeReitz: Distribution = {
  shape: ["c"],
  glsl: `
float distribution(float shape[MAX_SHAPE], float chord) {
  float cSquared = shape[0] * shape[0];
  float ratio = cSquared / (sineSquared(chord) * (1.0 - cSquared) + cSquared);
  return ratio * ratio;
}`,
};

/** [Burley2012]. */
export const generalisedTrowbridgeReitz: Distribution = {
  shape: ["c", "exponent"],
  glsl: `
float distribution(float shape[MAX_SHAPE], float chord) {
  float cSquared = shape[0] * shape[0];
  return exp(-shape[1] * logOnePlus(sineSquared(chord) * (1.0 - cSquared) / cSquared));
}`,
};

/** [TorranceSparrow1967], [Blinn1977]; the series is the core's. */
export const gaussian: Distribution = {
  shape: ["m"],
  glsl: `
float distribution(float shape[MAX_SHAPE], float chord) {
  float x = 0.25 * chord;
  float sum = 0.372402458434;
  sum = sum * x - 0.4184865884;
  sum = sum * x + 0.327472653687;
  sum = sum * x - 0.0306323304015;
  sum = sum * x + 0.0985616054666;
  sum = sum * x + 0.112501547467;
  sum = sum * x + 0.177868763769;
  sum = sum * x + 0.333331563364;
  sum = sum * x + 1.00000000563;
  return exp(-sum * chord / (shape[0] * shape[0]));
}`,
};

/** Symmetric V-grooves [TorranceSparrow1967]. */
export const vGroove: Masking = {
  glsl: `
float overNormalView(float shape, float normalLight, float normalView, float normalHalf, Illumination at) {
  return min(2.0 * normalHalf * at.perLightHalf * min(normalLight, normalView), 1.0) / normalView;
}`,
};

/** Smith, correlated by height [Heitz2014, Eq. 99]. */
export const smith: Masking = {
  glsl: `
float overNormalView(float shape, float normalLight, float normalView, float normalHalf, Illumination at) {
  float alphaSquared = shape * shape;
  float rest = 1.0 - alphaSquared;
  float lightRoot = sqrt(rest * normalLight * normalLight + alphaSquared);
  float viewRoot = sqrt(rest * normalView * normalView + alphaSquared);
  return 2.0 * normalLight / (normalView * lightRoot + normalLight * viewRoot);
}`,
};
