/** From what a person has chosen to what is drawn of a store. */

import type { Content, Range, Scene, View } from "../gl/scene";
import { dot } from "../gl/told";
import type { ModelEntry } from "../store/attributes";
import { asProblem, type StoreProblem } from "../store/errors";
import type { PublishedStore } from "../store/published";
import { ontoArm } from "./hemisphere";
import { angles, direction, shaderLights } from "./lights";
import { contentOf, findColumn, findRange, hasLegend } from "./maps";
import { clamp, type Light, type State } from "./state";

const NO_RANGE: Range = { low: 0, high: 1, scale: "linear" };

export class Scenes {
  readonly #ranges = new Map<string, Range>();

  /**
   * @param changed - called when the range of a map's colours has become known
   * @param failed - called when it cannot be known
   */
  constructor(
    readonly store: PublishedStore,
    readonly changed: () => void,
    readonly failed: (problem: StoreProblem) => void,
  ) {}

  model(name: string): ModelEntry {
    const { models } = this.store.attributes;
    return models.find((model) => model.name === name) ?? models[0]!;
  }

  /** A state with what this store does not have replaced. */
  known(state: State): State {
    const { models, photographs, camera } = this.store.attributes;
    const has = (name: string) => models.some((model) => model.name === name);
    const [kind, which] = state.compare.split(":");
    const photograph = which === "nearest" || Number(which) < (photographs?.lights.length ?? 0);
    const comparable =
      kind === "alone"
        ? models.some((model) => model.residual)
        : kind === "model"
          ? has(which!)
          : kind === "photograph" && photographs && photograph;
    return {
      ...state,
      model: has(state.model) ? state.model : models[0]!.name,
      compare: comparable ? state.compare : "",
      lights:
        camera.mm_per_px === null
          ? state.lights.map((light) => ({ ...light, distance_mm: null }))
          : state.lights,
    };
  }

  /** A state after a change, with what no longer goes together put right. */
  after(state: State, change: Partial<State>): State {
    let next = { ...state, ...change };
    if (change.arm) {
      const lights = next.lights.map((light) => ({ ...light, ...ontoArm(light.zenith, light.azimuth) }));
      next = { ...next, lights };
    }
    const model = this.model(next.model);
    const { show } = next;
    const lost =
      (show.includes(":") && !findColumn(show, model)) ||
      (show === "specular" && model.lobes === 0) ||
      (show === "residual" && !model.residual);
    return lost ? { ...next, show: "radiance" } : next;
  }

  scene(state: State, view: View, still: boolean): Scene {
    return {
      view,
      contents: this.#contents(state),
      swipe: state.split === "swipe" ? state.swipe : null,
      lights: shaderLights(state.lights, this.store.attributes.display.matrix),
      exposure: 2 ** state.exposure,
      exaggeration: state.exaggeration,
      still,
      smooth: still && view.scale < 1,
    };
  }

  #contents(state: State): [Content] | [Content, Content] {
    const { show, compare, residual } = state;
    const model = this.model(state.model);
    const range = this.range(show, model);
    const content = (of: ModelEntry, added: boolean) => contentOf(show, of, this.store, range, added);
    const first = content(model, residual || show === "residual");
    const photograph = this.photograph(state);
    if (photograph !== null) return [first, { kind: "photograph", light: photograph }];
    if (!compare) return [first];
    if (compare === "alone") return [first, content(model, false)];
    return [first, content(this.model(compare.slice("model:".length)), residual)];
  }

  /** The range of a map's colours, as far as it is known. */
  range(show: string, model: ModelEntry): Range {
    const key = `${model.name} ${show}`;
    const known = this.#ranges.get(key);
    if (known || !hasLegend(show, model)) return known ?? NO_RANGE;
    this.#ranges.set(key, NO_RANGE);
    findRange(show, model, this.store).then(
      (range) => {
        this.#ranges.set(key, range);
        this.changed();
      },
      (error) => this.failed(asProblem(error, this.store.http.url.href)),
    );
    return NO_RANGE;
  }

  /** Which photograph is compared with, if one is. */
  photograph(state: State): number | null {
    const [kind, which] = state.compare.split(":");
    if (kind !== "photograph") return null;
    return which === "nearest" ? this.nearest(state).index : Number(which);
  }

  /** The photograph whose light stands nearest to the chosen one, and how far away. */
  nearest({ lights, active }: State): { index: number; angle_deg: number } {
    const chosen = direction(lights[active]!.zenith, lights[active]!.azimuth);
    const cosines = this.store.attributes.photographs!.lights.map((light) => dot(light.direction, chosen));
    const index = cosines.indexOf(Math.max(...cosines));
    return { index, angle_deg: (Math.acos(clamp(cosines[index]!, -1, 1)) * 180) / Math.PI };
  }

  /** Where the light of a photograph stood, and how strong it was. */
  lightOf(photograph: number): Partial<Light> {
    const { photographs, camera } = this.store.attributes;
    const { direction: towards, position_mm: position, intensity } = photographs!.lights[photograph]!;
    const near = position && camera.mm_per_px !== null;
    return {
      ...angles(near ? position : towards),
      distance_mm: near ? Math.hypot(...position) : null,
      intensity: intensity.reduce((sum, value) => sum + value, 0) / intensity.length,
    };
  }
}
