/** Tiles on the graphics card: loaded on demand, nearest first, cancelled when no longer wanted, bounded in memory. */

import { isAbort, type StoreProblem } from "../store/errors";
import { release } from "../store/gzip";
import type { Codes, Layer, PublishedStore } from "../store/published";
import { nearest } from "./program";

/** Each takes some 15 MB while it is decoded; browsers open at most six connections to a host by HTTP/1.1. */
const AT_ONCE = 3;
const RETRY_MS = 5000;

export interface TileKey {
  readonly layer: Layer;
  readonly level: number;
  readonly row: number;
  readonly column: number;
}

export interface Tile extends TileKey {
  readonly texture: WebGLTexture;
  readonly bytes: number;
  /** Texels of four codes per pixel. */
  readonly blocks: number;
  /** Pixels of the picture that the tile holds. */
  readonly width: number;
  readonly height: number;
  used: number;
}

export function keyOf({ layer, level, row, column }: TileKey): string {
  return `${layer.id}/${level}/${row}/${column}`;
}

export function blocksOf(layer: Layer): number {
  return Math.ceil(layer.depth / 4);
}

/** Bytes of one tile on the graphics card. */
export function bytesOf(layer: Layer): number {
  return layer.chunk * layer.chunk * blocksOf(layer) * 4 * layer.bytes;
}

export class Tiles {
  readonly #there = new Map<string, Tile>();
  readonly #loading = new Map<string, AbortController>();
  readonly #failed = new Map<string, number>();
  readonly #room = new Map<string, Codes>();
  #wanted: TileKey[] = [];
  /** Loads that take memory: also those given up whose chunk is being decoded, which nothing stops. */
  #running = 0;
  #frame = 0;
  #bytes = 0;
  /** Called when a tile has come. */
  onload: (tile: Tile) => void = () => {};
  onproblem: (problem: StoreProblem) => void = () => {};

  constructor(
    readonly gl: WebGL2RenderingContext,
    readonly store: PublishedStore,
    public limit: number,
  ) {}

  get bytes(): number {
    return this.#bytes;
  }
  get pending(): number {
    return this.#loading.size + this.#wanted.length;
  }

  /** Starts a frame: tiles used from now on are not dropped for others of the same frame. */
  begin(): void {
    this.#frame++;
  }

  get(key: TileKey): Tile | undefined {
    const tile = this.#there.get(keyOf(key));
    if (tile) tile.used = this.#frame;
    return tile;
  }

  /** Loads these tiles, the first first, and gives up on all others. */
  want(keys: readonly TileKey[]): void {
    const now = performance.now();
    const names = new Set<string>();
    this.#wanted = [];
    for (const key of keys) {
      const name = keyOf(key);
      if (names.has(name)) continue;
      names.add(name);
      const failed = this.#failed.get(name);
      if (this.#there.has(name) || this.#loading.has(name) || (failed && now - failed < RETRY_MS)) continue;
      this.#wanted.push(key);
    }
    for (const [name, controller] of this.#loading) {
      if (!names.has(name)) {
        controller.abort();
        this.#loading.delete(name);
      }
    }
    this.#next();
  }

  dispose(): void {
    this.#wanted = [];
    for (const controller of this.#loading.values()) controller.abort();
    for (const tile of this.#there.values()) this.gl.deleteTexture(tile.texture);
    this.#there.clear();
  }

  #next(): void {
    while (this.#running < AT_ONCE) {
      const key = this.#wanted.shift();
      if (!key) return;
      void this.#load(key);
    }
  }

  async #load(key: TileKey): Promise<void> {
    const name = keyOf(key);
    const controller = new AbortController();
    this.#loading.set(name, controller);
    this.#running++;
    try {
      const codes = await this.store.chunk(key.layer, key.level, key.row, key.column, controller.signal);
      if (controller.signal.aborted) {
        release(codes);
        return;
      }
      this.#failed.delete(name);
      const tile = this.#upload(key, codes);
      this.#there.set(name, tile);
      this.#bytes += tile.bytes;
      this.#evict();
      this.#loading.delete(name);
      this.onload(tile);
    } catch (error) {
      if (controller.signal.aborted || isAbort(error)) return;
      this.#failed.set(name, performance.now());
      this.onproblem(error as StoreProblem);
    } finally {
      this.#running--;
      if (this.#loading.get(name) === controller) this.#loading.delete(name);
      this.#next();
    }
  }

  #upload(key: TileKey, codes: Codes): Tile {
    const { gl } = this;
    const { layer } = key;
    const blocks = blocksOf(layer);
    const texture = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, texture);
    const size = [layer.chunk * blocks, layer.chunk] as const;
    const [format, type] =
      layer.bytes === 1 ? [gl.RGBA8UI, gl.UNSIGNED_BYTE] : [gl.RGBA16UI, gl.UNSIGNED_SHORT];
    gl.texStorage2D(gl.TEXTURE_2D, 1, format, ...size);
    const data = this.#padded(codes, layer);
    gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, ...size, gl.RGBA_INTEGER, type, data);
    nearest(gl);
    release(codes);
    const [height, width] = this.store.size(key.level);
    return {
      ...key,
      texture,
      bytes: bytesOf(layer),
      blocks,
      width: Math.min(layer.chunk, width - key.column * layer.chunk),
      height: Math.min(layer.chunk, height - key.row * layer.chunk),
      used: this.#frame,
    };
  }

  /** Codes as groups of four, the rest of a pixel's last group 0; in memory that the next tile takes too. */
  #padded(codes: Codes, layer: Layer): Codes {
    const stride = 4 * blocksOf(layer);
    if (stride === layer.depth) return codes;
    const key = `${layer.bytes}/${layer.depth}`;
    const size = layer.chunk * layer.chunk * stride;
    const room = this.#room.get(key) ?? (layer.bytes === 1 ? new Uint8Array(size) : new Uint16Array(size));
    this.#room.set(key, room);
    return padded(codes, layer.depth, room);
  }

  #evict(): void {
    if (this.#bytes <= this.limit) return;
    const oldest = [...this.#there].filter(([, tile]) => tile.used < this.#frame);
    oldest.sort(([, a], [, b]) => a.used - b.used);
    for (const [name, tile] of oldest) {
      if (this.#bytes <= this.limit) return;
      this.gl.deleteTexture(tile.texture);
      this.#there.delete(name);
      this.#bytes -= tile.bytes;
    }
  }
}

/** Writes codes of `depth` per pixel into `room`, which has more for each, and returns it. */
export function padded(codes: Codes, depth: number, room: Codes): Codes {
  const stride = (room.length * depth) / codes.length;
  for (let from = 0, to = 0; from < codes.length; to += stride - depth) {
    for (let i = 0; i < depth; i++) room[to++] = codes[from++]!;
  }
  return room;
}
