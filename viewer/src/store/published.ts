/** A published store, as docs/store.md specifies it. Everything read from it is checked here, once. */

import * as zarr from "zarrita";
import { findModel, MAX_LOBES } from "../models";
import { asProblem, StoreProblem } from "./errors";
import { HttpStore } from "./http";

export const SCHEMA = 1;
const MAX_COLUMNS = 32;

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

/** An array whose last axis are the columns; the axes before y and x are fixed by the layer. */
export interface Layer {
  readonly id: string;
  path(level: number): string;
  readonly columns: readonly Column[];
  readonly before: readonly number[];
  readonly chunk: number;
  readonly levels: readonly number[];
}

export class PublishedStore {
  readonly #arrays = new Map<string, Promise<zarr.Array<"uint16", HttpStore>>>();

  private constructor(
    readonly http: HttpStore,
    readonly attributes: Attributes,
  ) {}

  /** Reads the root's metadata, with which all others come. */
  static async open(url: string | URL, signal?: AbortSignal): Promise<PublishedStore> {
    let http: HttpStore;
    try {
      http = new HttpStore(url);
    } catch {
      throw new StoreProblem("unreachable", String(url));
    }
    const where = new URL("zarr.json", http.url).href;
    const body = await http.get("/zarr.json", signal ? { signal } : {});
    let document: Record<string, unknown>;
    try {
      document = JSON.parse(new TextDecoder().decode(body)) as Record<string, unknown>;
    } catch {
      throw new StoreProblem("not-a-store", where);
    }
    const attributes = checked(document.attributes, where);
    const consolidated =
      (document.consolidated_metadata as { metadata?: object } | undefined)?.metadata ?? {};
    const encoder = new TextEncoder();
    for (const [path, metadata] of Object.entries(consolidated)) {
      http.documents.set(`/${path}/zarr.json`, encoder.encode(JSON.stringify(metadata)));
    }
    return new PublishedStore(http, attributes);
  }

  get height(): number {
    return this.attributes.size[0];
  }
  get width(): number {
    return this.attributes.size[1];
  }

  /** Height and width of a level: half of the one before, odd sizes rounded up. */
  size(level: number): [number, number] {
    let [height, width] = this.attributes.size;
    for (let i = 0; i < level; i++) [height, width] = [(height + 1) >> 1, (width + 1) >> 1];
    return [height, width];
  }

  layer(model: ModelEntry, kind: "parameters" | "quality"): Layer {
    return {
      id: `${kind}/${model.name}`,
      path: (level) => `models/${model.name}/${level}/${kind}`,
      columns: model[kind],
      before: [],
      chunk: 512,
      levels: range(this.attributes.levels),
    };
  }

  photograph(light: number): Layer {
    const { transfer, scale, offset } = this.attributes.photographs!;
    const columns = this.attributes.light_rgb.map(
      (_, component): Column => ({
        name: "radiance",
        component,
        transfer,
        scale,
        offset,
        units: "1",
        long_name: "relative radiance",
      }),
    );
    return {
      id: `photograph/${light}`,
      path: (level) => `photographs/${level}`,
      columns,
      before: [light],
      chunk: 256,
      levels: range(this.attributes.levels),
    };
  }

  heights(): Layer | null {
    const height = this.attributes.height;
    if (!height) return null;
    return {
      id: "height",
      path: (level) => `height/${level}`,
      columns: [height.column],
      before: [],
      chunk: 512,
      levels: range(this.attributes.levels).filter((level) => level >= height.level),
    };
  }

  /** Codes of a chunk, row by row with the columns side by side. */
  async chunk(
    layer: Layer,
    level: number,
    row: number,
    column: number,
    signal?: AbortSignal,
  ): Promise<Uint16Array> {
    const path = layer.path(level);
    const where = `${this.http.url.href}${path}/c/${[...layer.before, row, column, 0].join("/")}`;
    try {
      let array = this.#arrays.get(path);
      if (!array) {
        array = this.#open(path, layer);
        this.#arrays.set(path, array);
        array.catch(() => this.#arrays.delete(path));
      }
      const opened = await array;
      const chunk = await opened.getChunk([...layer.before, row, column, 0], signal ? { signal } : undefined);
      if (chunk.data.length !== layer.chunk * layer.chunk * layer.columns.length) {
        throw new StoreProblem("damaged", where, `${chunk.data.length} values`);
      }
      return chunk.data;
    } catch (error) {
      signal?.throwIfAborted();
      throw asProblem(error, where);
    }
  }

  async #open(path: string, layer: Layer): Promise<zarr.Array<"uint16", HttpStore>> {
    const where = `${this.http.url.href}${path}/zarr.json`;
    const array = await zarr.open.v3(zarr.root(this.http).resolve(path), { kind: "array" });
    const expected = [...layer.before.map(() => 1), layer.chunk, layer.chunk, layer.columns.length];
    // A chunk of another size than the page makes room for could take any amount of memory.
    if (array.dtype !== "uint16" || String(array.chunks) !== String(expected)) {
      throw new StoreProblem("unsupported", where, `${array.dtype}, chunks of ${array.chunks}`);
    }
    return array as zarr.Array<"uint16", HttpStore>;
  }
}

function range(count: number): number[] {
  return Array.from({ length: count }, (_, index) => index);
}

function checked(given: unknown, where: string): Attributes {
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
