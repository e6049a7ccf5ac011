/** What the person at the page has chosen, and the same as the part of an address behind `#`. */

import { MODES } from "../gl/model-shader";
import type { View } from "../gl/scene";

export interface Light {
  /** Degrees from the painting's normal, and around it from the right towards the top. */
  readonly zenith: number;
  readonly azimuth: number;
  /** Distance from the middle of the painting; null is infinitely far away. */
  readonly distance_mm: number | null;
  /** Angular diameter. */
  readonly size_deg: number;
  readonly intensity: number;
  readonly kelvin: number;
}

export interface State {
  readonly model: string;
  /** A mode of the shader, or `parameters:c:0`, `quality:residual_rms:0`, `height`. */
  readonly show: string;
  /** Whether to add what the model leaves over, where the store has it. */
  readonly residual: boolean;
  /** `model:NAME`, `alone` (the same model without its residual), `photograph:nearest`, `photograph:NUMBER`, or nothing. */
  readonly compare: string;
  readonly split: "swipe" | "side";
  readonly swipe: number;
  readonly lights: readonly Light[];
  /** The light that is moved. */
  readonly active: number;
  readonly arm: boolean;
  /** Stops: each doubles the brightness. */
  readonly exposure: number;
  readonly exaggeration: number;
  /** null fits the whole picture. */
  readonly view: View | null;
}

export const DAYLIGHT = 6504;

export const FIRST_LIGHT: Light = {
  zenith: 45,
  azimuth: 135,
  distance_mm: null,
  size_deg: 0,
  intensity: 1,
  kelvin: DAYLIGHT,
};

export const MOST_LIGHTS = 4;

export function initialState(model: string): State {
  return {
    model,
    show: "radiance",
    residual: true,
    compare: "",
    split: "swipe",
    swipe: 0.5,
    lights: [FIRST_LIGHT],
    active: 0,
    arm: false,
    exposure: 0,
    exaggeration: 0,
    view: null,
  };
}

const round = (value: number, digits: number) => String(Number(value.toFixed(digits)));

/** Writes a state for an address. */
export function toHash(state: State): string {
  const lights = state.lights.map((light) =>
    [
      round(light.zenith, 2),
      round(light.azimuth, 2),
      light.distance_mm === null ? "" : round(light.distance_mm, 0),
      round(light.size_deg, 1),
      round(light.intensity, 2),
      round(light.kelvin, 0),
    ].join(","),
  );
  const parts: [string, string][] = [
    ["model", state.model],
    ["show", state.show],
    ["light", lights.join(";")],
  ];
  if (!state.residual) parts.push(["residual", "0"]);
  if (state.compare) parts.push(["compare", state.compare], ["split", state.split]);
  if (state.compare && state.split === "swipe") parts.push(["swipe", round(state.swipe, 3)]);
  if (state.active) parts.push(["active", String(state.active)]);
  if (state.arm) parts.push(["arm", "1"]);
  if (state.exposure) parts.push(["exposure", round(state.exposure, 2)]);
  if (state.exaggeration) parts.push(["exaggeration", round(state.exaggeration, 2)]);
  if (state.view) {
    const { x, y, scale } = state.view;
    parts.push(["view", `${round(x, 2)},${round(y, 2)},${round(scale, 5)}`]);
  }
  return parts.map(([name, value]) => `${name}=${encodeURI(value).replaceAll("&", "%26")}`).join("&");
}

/** Reads a state from an address; what cannot be understood stays as it was. */
export function fromHash(hash: string, state: State): State {
  const given = new Map<string, string>();
  for (const part of hash.replace(/^#/, "").split("&")) {
    const [name, value = ""] = part.split(/=(.*)/s);
    try {
      if (name) given.set(name, decodeURIComponent(value));
    } catch {
      // a broken escape
    }
  }
  const number = (name: string, low: number, high: number, otherwise: number) => {
    const value = Number(given.get(name) || Number.NaN);
    return Number.isFinite(value) ? clamp(value, low, high) : otherwise;
  };
  const lights = (given.get("light") ?? "").split(";").flatMap(parseLight).slice(0, MOST_LIGHTS);
  const view = (given.get("view") ?? "").split(",").map(Number);
  const split = given.get("split");
  return {
    model: given.get("model") ?? state.model,
    show: isShow(given.get("show")) ? given.get("show")! : state.show,
    residual: given.get("residual") !== "0",
    compare: given.has("model") || given.has("compare") ? (given.get("compare") ?? "") : state.compare,
    split: split === "side" || split === "swipe" ? split : state.split,
    swipe: number("swipe", 0, 1, state.swipe),
    lights: lights.length ? lights : state.lights,
    active: Math.min(number("active", 0, MOST_LIGHTS, 0), Math.max(lights.length, 1) - 1),
    arm: given.has("arm"),
    exposure: number("exposure", -6, 6, 0),
    exaggeration: number("exaggeration", 0, 8, 0),
    view:
      view.length === 3 && view.every(Number.isFinite) && view[2]! > 0
        ? { x: view[0]!, y: view[1]!, scale: view[2]! }
        : state.view,
  };
}

function isShow(show: string | undefined): boolean {
  return (
    show !== undefined && (show in MODES || show === "height" || /^(parameters|quality):\w+:\d+$/.test(show))
  );
}

function parseLight(text: string): Light[] {
  const [zenith, azimuth, distance, size, intensity, kelvin] = text
    .split(",")
    .map((part) => (part === "" ? Number.NaN : Number(part)));
  if (zenith === undefined || azimuth === undefined || !Number.isFinite(zenith + azimuth)) return [];
  const or = (value: number | undefined, otherwise: number) =>
    value === undefined || Number.isNaN(value) ? otherwise : value;
  return [
    {
      zenith: clamp(zenith, 0, 89),
      azimuth: azimuth % 360,
      distance_mm: or(distance, 0) > 0 ? clamp(distance!, 10, 100_000) : null,
      size_deg: clamp(or(size, 0), 0, 60),
      intensity: clamp(or(intensity, 1), 0, 100),
      kelvin: clamp(or(kelvin, DAYLIGHT), 1000, 20_000),
    },
  ];
}

export function clamp(value: number, low: number, high: number): number {
  return Math.min(Math.max(value, low), high);
}
