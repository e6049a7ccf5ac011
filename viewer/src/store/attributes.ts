/** What the root of a published store says, as docs/store.md specifies it. It is checked here, once. */

import { findModel, MAX_LOBES } from "../models";
import { StoreProblem } from "./errors";

export const SCHEMA = 1;
const MAX_COLUMNS = 32;
const MAX_COMPONENTS = 64;

export interface Column {
  readonly name: string;
  readonly component: number;
  readonly transfer: "linear" | "log";
  readonly scale: number;
  readonly offset: number;
  readonly units: string;
  readonly long_name: string;
}

export interface GlossTable {
  readonly angle_deg: number;
  readonly axes: readonly { low: number; high: number; count: number }[];
  readonly values: readonly number[];
}

export interface ModelEntry {
  readonly name: string;
  /** The model of the shader's list, without a word about the ambient term. */
  readonly base: string;
  readonly title: string;
  readonly lobes: number;
  readonly shape: readonly { name: string; meaning: string; lower: number; upper: number }[];
  readonly parameters: readonly Column[];
  readonly quality: readonly Column[];
  readonly gloss: readonly GlossTable[];
  readonly index_of_refraction: number;
  readonly fresnel: "facet" | "element";
  readonly light_rgb: readonly number[];
  readonly status_meaning: Readonly<Record<string, string>>;
  readonly sample?: { arm_azimuth_deg?: number };
  readonly residual?: ResidualTerm | null;
  readonly self_calibration?: { readonly distances?: { readonly told?: ToldDistance } };
}

/** How far away lights stood, over the painting's longer side: docs/store.md, "Lights found to be near". */
export interface ToldDistance extends Told {
  readonly distance: number;
  readonly direction?: readonly (readonly number[])[];
}

/** What a model leaves over, over the light's direction: docs/store.md, "The residual term". */
export interface ResidualTerm {
  readonly components: number;
  /** The coefficient of each of 256 codes. */
  readonly table: readonly number[];
  readonly toe: number;
  readonly direction: readonly (readonly number[])[];
  readonly length: number;
  readonly weights: readonly (readonly (readonly number[])[])[];
  readonly hull: readonly (readonly number[])[];
  readonly fade: number;
}

/** What lights tell of others, in one channel: by a table; in older stores by a kernel's length and weights. */
export interface Told {
  /** By zenith angle from 0 to 90°, and azimuth. */
  readonly table?: readonly [readonly (readonly number[])[]];
  readonly length?: number;
  /** Of each light. */
  readonly weights?: readonly [readonly number[]];
}

export interface PhotographLight {
  readonly name: string;
  readonly direction: readonly number[];
  readonly position_mm: readonly number[] | null;
  readonly intensity: readonly number[];
}

export interface Attributes {
  readonly impasto_published: number;
  readonly title: string;
  readonly size: readonly [number, number];
  readonly levels: number;
  readonly camera: { view_direction: number[]; distance_mm: number | null; mm_per_px: number | null };
  readonly light_rgb: readonly number[];
  readonly white_reference: boolean;
  readonly display: { matrix: number[][]; profile?: string };
  readonly models: readonly ModelEntry[];
  readonly photographs: {
    transfer: "linear" | "log";
    scale: number;
    offset: number;
    lights: readonly PhotographLight[];
  } | null;
  readonly height?: { level: number; column: Column } | null;
}

/** Returns the attributes of a root if the page can use them. */
export function checked(given: unknown, where: string): Attributes {
  const attributes = given as Attributes | undefined;
  const schema = attributes?.impasto_published;
  if (!attributes || typeof schema !== "number") throw new StoreProblem("not-a-store", where);
  if (schema > SCHEMA) throw new StoreProblem("newer", where, `${schema} > ${SCHEMA}`);
  const bad = (what: string) => new StoreProblem("damaged", where, what);
  const sides = attributes.size;
  if (!Array.isArray(sides) || sides.length !== 2 || !sides.every((n) => Number.isInteger(n) && n > 0)) {
    throw bad("size");
  }
  if (!Number.isInteger(attributes.levels) || attributes.levels < 1 || attributes.levels > 24)
    throw bad("levels");
  const channels = attributes.light_rgb?.length;
  if (channels !== 1 && channels !== 3) throw bad("light_rgb");
  if (!isCamera(attributes.camera)) throw bad("camera");
  const rows = attributes.display?.matrix;
  if (!Array.isArray(rows) || rows.length !== 3 || !rows.every((row) => row.every(Number.isFinite))) {
    throw bad("display.matrix");
  }
  if (!Array.isArray(attributes.models) || attributes.models.length === 0) throw bad("models");
  for (const entry of attributes.models) {
    const columns = [...(entry.parameters ?? []), ...(entry.quality ?? [])];
    if (!/^[a-z0-9-]+$/.test(entry.name) || !columns.every((c) => Number.isFinite(c.scale + c.offset))) {
      throw bad(`models: ${entry.name}`);
    }
    if (Math.max(entry.parameters.length, entry.quality.length) > MAX_COLUMNS || entry.lobes > MAX_LOBES) {
      throw new StoreProblem("unsupported", where, entry.name);
    }
    const surface = entry.index_of_refraction > 0 && ["facet", "element"].includes(entry.fresnel);
    if (!surface || !numbers(entry.light_rgb, channels)) throw bad(`models: ${entry.name}`);
    if (entry.residual && !isWhole(entry.residual, channels)) throw bad(`models: ${entry.name}: residual`);
    const told = entry.self_calibration?.distances?.told;
    if (told && !isToldDistance(told)) throw bad(`models: ${entry.name}: self_calibration`);
  }
  return { ...attributes, models: attributes.models.filter(drawable) };
}

/** Whether the shader knows the model and all that it needs is there; others are not offered. */
function drawable(entry: ModelEntry): boolean {
  const model = findModel(entry.base);
  const has = (name: string) => entry.parameters.some((column) => column.name === name);
  const needed = ["normal", "diffuse", ...(model?.shape ?? []), ...(model?.lobes ? ["specular"] : [])];
  return model !== undefined && entry.parameters[0]?.name === "normal" && needed.every(has);
}

const numbers = (list: unknown, count: number) =>
  Array.isArray(list) && list.length === count && list.every(Number.isFinite);
const vectors = (list: unknown) => Array.isArray(list) && list.every((each) => numbers(each, 3));

/** Whether it says where the camera stands; lengths are null where they are not known. */
function isCamera(camera: Attributes["camera"] | undefined): boolean {
  const lengths = [camera?.distance_mm, camera?.mm_per_px];
  return numbers(camera?.view_direction, 3) && lengths.every((length) => length === null || length! > 0);
}

/** Whether what so many lights tell has all its numbers. */
function isTold({ table, weights, length }: Told, lights: number): boolean {
  if (!table) return length! > 0 && weights?.length === 1 && numbers(weights[0], lights);
  const [rows] = table;
  const columns = rows?.[0]?.length ?? 0;
  return table.length === 1 && rows.length > 1 && columns > 0 && rows.every((row) => numbers(row, columns));
}

/** Whether a distance has all its numbers. */
function isToldDistance(found: ToldDistance): boolean {
  const { distance, direction = [] } = found;
  const smooth = () => vectors(direction) && isTold(found, direction.length);
  return distance > 0 && ((!found.table && !found.weights) || smooth());
}

/** Whether a residual term has all its numbers. */
function isWhole(term: ResidualTerm, channels: number): boolean {
  const { components, direction, weights, hull } = term;
  return (
    Number.isInteger(components) &&
    components >= 1 &&
    components <= MAX_COMPONENTS &&
    numbers(term.table, 256) &&
    [term.toe, term.length, term.fade].every((value) => value > 0) &&
    vectors(direction) &&
    vectors(hull) &&
    weights?.length === components &&
    weights.every(
      (each) => each.length === channels && each.every((values) => numbers(values, direction.length)),
    )
  );
}
