/** At what distance a fit found its lights: docs/store.md, "Lights found to be near"; src/impasto/light_distance.py. */

import type { Attributes, ModelEntry } from "../store/attributes";
import type { ShaderLight } from "./scene";
import { dot, told } from "./told";

type Place = Pick<ShaderLight, "place" | "near">;

/** Puts lights that are far away where the model's fit found those of the photographs, if it found them near. */
export function placeLights<L extends Place>(
  lights: readonly L[],
  model: ModelEntry,
  { size, camera }: Pick<Attributes, "size" | "camera">,
): readonly L[] {
  const found = model.self_calibration?.distances?.told;
  if (!found) return lights;
  // Without a scale, lengths are in pixels.
  const extent = Math.max(...size) * (camera.mm_per_px ?? 1);
  return lights.map((light) => {
    if (light.near) return light;
    const own = found.table || found.weights ? told(found, found.direction ?? [], light.place) : 0;
    const distance = found.distance * Math.exp(own) * extent;
    const [x, y, z] = light.place;
    return { ...light, place: [x * distance, y * distance, z * distance], near: true };
  });
}

/** Returns the direction of a light at a place of the painting, and its irradiance there over that at the centre. */
export function seenFrom(
  [x, y]: readonly [number, number],
  { place, near }: Place,
): { direction: [number, number, number]; falloff: number } {
  if (!near) return { direction: [...place], falloff: 1 };
  const [dx, dy, dz] = [place[0] - x, place[1] - y, place[2]];
  const squared = dx * dx + dy * dy + dz * dz;
  const length = Math.sqrt(squared);
  return { direction: [dx / length, dy / length, dz / length], falloff: dot(place, place) / squared };
}
