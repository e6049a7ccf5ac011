/** The models that the shader knows: one file each, and one line here, as in core/src/models/mod.rs. */

import { lambert } from "./lambert";
import { gaussian, generalisedTrowbridgeReitz, smith, trowbridgeReitz, vGroove } from "./microfacet";
import type { Model } from "./model";
import { orenNayar } from "./oren-nayar";
import { phong } from "./phong";
import { torranceSparrow } from "./torrance-sparrow";
import { twoLobes } from "./two-lobes";
import { ward } from "./ward";
import { wardAnisotropic } from "./ward-anisotropic";

export type { Model } from "./model";

export const MODELS: readonly Model[] = [
  lambert,
  orenNayar,
  phong,
  torranceSparrow("torrance-sparrow", trowbridgeReitz, vGroove),
  torranceSparrow("torrance-sparrow-gaussian", gaussian, vGroove),
  torranceSparrow("torrance-sparrow-smith", trowbridgeReitz, smith),
  twoLobes,
  torranceSparrow("gtr", generalisedTrowbridgeReitz, vGroove),
  ward,
  wardAnisotropic,
];

/** The largest number of shape parameters and of lobes of any model. */
export const MAX_SHAPE = Math.max(...MODELS.map((model) => model.shape.length));
export const MAX_LOBES = Math.max(...MODELS.map((model) => model.lobes), 1);

export function findModel(name: string): Model | undefined {
  return MODELS.find((model) => model.name === name);
}
