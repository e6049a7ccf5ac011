/** A published store and its arrays, chunk by chunk. */

import * as zarr from "zarrita";
import { type Attributes, type Column, checked, type ModelEntry } from "./attributes";
import { asProblem, StoreProblem } from "./errors";
import { useOwnGzip } from "./gzip";
import { HttpStore } from "./http";

useOwnGzip();

/** Codes of a chunk, row by row with those of a pixel side by side. */
export type Codes = Uint16Array | Uint8Array;

/** An array whose last axis are the codes of a pixel; the axes before y and x are fixed by the layer. */
export interface Layer {
  readonly id: string;
  path(level: number): string;
  /** What each code means, where each has a meaning of its own. */
  readonly columns: readonly Column[];
  /** Codes per pixel, and bytes per code. */
  readonly depth: number;
  readonly bytes: 1 | 2;
  readonly before: readonly number[];
  readonly chunk: number;
  readonly levels: readonly number[];
}

export class PublishedStore {
  readonly #arrays = new Map<string, Promise<zarr.Array<"uint16" | "uint8", HttpStore>>>();

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
      depth: model[kind].length,
      bytes: 2,
      before: [],
      chunk: 512,
      levels: range(this.attributes.levels),
    };
  }

  /** The coefficients of a model's residual term. */
  residual(model: ModelEntry): Layer | null {
    if (!model.residual) return null;
    return {
      id: `residual/${model.name}`,
      path: (level) => `models/${model.name}/${level}/residual`,
      columns: [],
      depth: model.residual.components,
      bytes: 1,
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
      depth: columns.length,
      bytes: 2,
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
      depth: 1,
      bytes: 2,
      before: [],
      chunk: 512,
      levels: range(this.attributes.levels).filter((level) => level >= height.level),
    };
  }

  async chunk(
    layer: Layer,
    level: number,
    row: number,
    column: number,
    signal?: AbortSignal,
  ): Promise<Codes> {
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
      if (chunk.data.length !== layer.chunk * layer.chunk * layer.depth) {
        throw new StoreProblem("damaged", where, `${chunk.data.length} values`);
      }
      return chunk.data;
    } catch (error) {
      signal?.throwIfAborted();
      throw asProblem(error, where);
    }
  }

  async #open(path: string, layer: Layer): Promise<zarr.Array<"uint16" | "uint8", HttpStore>> {
    const where = `${this.http.url.href}${path}/zarr.json`;
    const array = await zarr.open.v3(zarr.root(this.http).resolve(path), { kind: "array" });
    const expected = [...layer.before.map(() => 1), layer.chunk, layer.chunk, layer.depth];
    // A chunk of another size than the page makes room for could take any amount of memory.
    if (array.dtype !== `uint${8 * layer.bytes}` || String(array.chunks) !== String(expected)) {
      throw new StoreProblem("unsupported", where, `${array.dtype}, chunks of ${array.chunks}`);
    }
    return array as zarr.Array<"uint16" | "uint8", HttpStore>;
  }
}

function range(count: number): number[] {
  return Array.from({ length: count }, (_, index) => index);
}
