/** At what distance a fit found its lights: docs/store.md, "Lights found to be near"; src/impasto/light_distance.py. */

import type { Attributes, ModelEntry } from "../store/attributes";
import type { ShaderLight } from "./scene";
import { told } from "./told";

/** Puts lights that are far away where the model's fit found those of the photographs, if it found them near. */
export function placeLights(
  lights: readonly ShaderLight[],
  model: ModelEntry,
  { size, camera }: Pick<Attributes, "size" | "camera">,
): readonly ShaderLight[] {
  const found = model.self_calibration?.distances?.told;
  if (!found) return lights;
  // Without a scale, lengths are in pixels.
  const extent = Math.max(...size) * (camera.mm_per_px ?? 1);
  return lights.map((light) => {
    if (light.near) return light;
    const own = found.table || found.weights ? told(found, found.direction ?? [], light.place)[0]! : 0;
    const distance = found.distance * Math.exp(own) * extent;
    const [x, y, z] = light.place;
    return { ...light, place: [x * distance, y * distance, z * distance], near: true };
  });
}
